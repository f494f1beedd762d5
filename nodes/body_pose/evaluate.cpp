// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/time/clock.hpp"

namespace takt::body_pose {
namespace {

constexpr double kHeadNear_m = 0.35;

double ms_since(int64_t cpu_ns) { return static_cast<double>(thread_cpu_ns() - cpu_ns) / 1e6; }

const auto kWithoutEnd = [] { return true; };

}  // namespace

const DetectedBody* match(const TrueBody& truth, std::span<const DetectedBody> found) {
  const DetectedBody* best = nullptr;
  double nearest = kHeadNear_m;
  for (const DetectedBody& body : found) {
    const double distance = (body.fit.ends[0].cast<double>() - truth.joints[0]).norm();
    if (distance < nearest) nearest = distance, best = &body;
  }
  return best;
}

void add(Figures& figures, const Skeleton& skeleton, const TrueBody& truth, std::span<const DetectedBody> found,
         double time_ms) {
  ++figures.trials;
  figures.time_ms.push_back(time_ms);
  const DetectedBody* body = match(truth, found);
  figures.extra += static_cast<int>(found.size()) - (body != nullptr ? 1 : 0);
  if (body == nullptr) return;
  ++figures.found;
  figures.valid += body->valid ? 1 : 0;
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    ++figures.links;
    if (body->fit.fitted[i]) figures.joint_m.push_back((body->fit.ends[i].cast<double>() - truth.joints[i]).norm());
    else ++figures.missing;
  }
  const Eigen::Vector3f direction = pointing_direction(body->fit, {truth.from, truth.to});
  if (direction.squaredNorm() == 0) return;
  const double cosine = std::clamp(direction.cast<double>().dot(truth.pointing()), -1.0, 1.0);
  figures.angle_deg.push_back(std::acos(cosine) * 180 / std::numbers::pi);
  figures.right += figures.angle_deg.back() <= kRight_deg ? 1 : 0;
}

Figures measure_people(BodyDetector& detector, const SceneCamera& camera, uint64_t seed, int trials) {
  Figures figures;
  for (int i = 0; i < trials; ++i) {
    const GeneratedScene scene = make_person(detector.skeleton(), camera, seed, static_cast<uint64_t>(i));
    const int64_t start = thread_cpu_ns();
    const auto found = detector.run(scene.in_floor, kWithoutEnd);
    add(figures, detector.skeleton(), scene.body, found, ms_since(start));
  }
  return figures;
}

Figures measure_any(const Skeleton& skeleton, const FitParameters& parameters, const SceneCamera& camera, uint64_t seed,
                    int trials) {
  constexpr double kFloor_m = 0.08, kVoxel_m = 0.03;
  Figures figures;
  const auto rays = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
  Fitter fitter(skeleton, parameters, rays);
  cloud::VoxelGrid grid(rays);
  for (int i = 0; i < trials; ++i) {
    const GeneratedScene scene = make_any(skeleton, camera, seed, static_cast<uint64_t>(i));
    std::vector<Point> points;
    for (const Point& p : scene.in_floor)
      if (p.z > kFloor_m) points.push_back(p);
    const int64_t start = thread_cpu_ns();
    grid.fill({points, {}}, kVoxel_m);
    points.clear();
    for (const cloud::Voxel& voxel : grid.voxels()) points.push_back(voxel.mean());
    const double density = reference_density(points, parameters.tube_m);
    const Fit fit = fitter.fit({points, scene.body.joints[0].cast<float>(), density}, kWithoutEnd);
    const DetectedBody body{fit, 0, is_valid(skeleton, parameters, fit), 0};
    add(figures, skeleton, scene.body, {&body, 1}, ms_since(start));
  }
  return figures;
}

}  // namespace takt::body_pose
