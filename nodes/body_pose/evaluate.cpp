// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/msg/point.hpp"
#include "rt/time/clock.hpp"

namespace takt::body_pose {
namespace {

constexpr double kHeadNear_m = 0.35;

double ms_since(int64_t cpu_ns) { return static_cast<double>(thread_cpu_ns() - cpu_ns) / 1e6; }

const auto kWithoutEnd = [] { return true; };

bool has_candidate(const BodyDetector& detector, const TrueBody& truth) {
  return std::any_of(detector.candidates().begin(), detector.candidates().end(), [&](const Candidate& candidate) {
    return (Eigen::Vector3d(candidate.head.x, candidate.head.y, candidate.head.z) - truth.joints[0]).norm() <
           kHeadNear_m;
  });
}

/// Points that lie on the arm that points, the trunk's apart.
int arm_points(const Skeleton& skeleton, const GeneratedScene& scene) {
  constexpr float kArm_m = 0.08f, kTrunk_m = 0.18f;
  const auto joint = [&](size_t i) -> Eigen::Vector3f { return scene.body.joints[i].cast<float>(); };
  const size_t elbow = skeleton.links[scene.body.to].parent;
  const Segment upper(joint(scene.body.from), joint(elbow)), lower(joint(elbow), joint(scene.body.to));
  const Segment trunk(joint(0), joint(skeleton.link("lower_back")));
  return static_cast<int>(std::count_if(scene.in_floor.begin(), scene.in_floor.end(), [&](const Point& p) {
    return std::min(upper.squared_distance(p.x, p.y, p.z), lower.squared_distance(p.x, p.y, p.z)) < kArm_m * kArm_m &&
           trunk.squared_distance(p.x, p.y, p.z) > kTrunk_m * kTrunk_m;
  }));
}

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

void add(Figures& figures, const Skeleton& skeleton, const TrueBody& truth, const Outcome& outcome) {
  ++figures.trials;
  figures.time_ms.push_back(outcome.time_ms);
  figures.searched += outcome.searched;
  const DetectedBody* body = match(truth, outcome.found);
  figures.extra += static_cast<int>(outcome.found.size()) - (body != nullptr ? 1 : 0);
  const auto miss = [&](int& cause) {
    ++cause;
    figures.misses.hidden += outcome.arm_hidden ? 1 : 0;
  };
  if (body == nullptr) return miss(outcome.candidate ? figures.misses.refused : figures.misses.no_candidate);
  ++figures.found;
  figures.valid += body->valid ? 1 : 0;
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    ++figures.links;
    if (body->fit.fitted[i]) figures.joint_m.push_back((body->fit.ends[i].cast<double>() - truth.joints[i]).norm());
    else ++figures.missing;
  }
  const auto angle_of = [&](const Pointer& pointer) {
    const Eigen::Vector3d direction = pointing_direction(body->fit, pointer).cast<double>();
    if (direction.squaredNorm() == 0) return 180.0;
    return std::acos(std::clamp(direction.dot(truth.pointing()), -1.0, 1.0)) * 180 / std::numbers::pi;
  };
  const bool fitted = body->fit.fitted[truth.from] && body->fit.fitted[truth.to];
  const double angle = angle_of({truth.from, truth.to});
  if (fitted) figures.angle_deg.push_back(angle);
  if (fitted && angle <= kRight_deg) {
    ++figures.right;
    return;
  }
  const bool other = std::any_of(skeleton.pointers.begin(), skeleton.pointers.end(), [&](const Pointer& pointer) {
    return pointer.to != truth.to && angle_of(pointer) <= kRight_deg;
  });
  miss(other ? figures.misses.other_arm : fitted ? figures.misses.elsewhere : figures.misses.arm_missing);
}

Figures measure_people(BodyDetector& detector, const SceneCamera& camera, uint64_t seed, int trials, double search_ms) {
  Figures figures;
  for (int i = 0; i < trials; ++i) {
    const GeneratedScene scene = make_person(detector.skeleton(), camera, seed, static_cast<uint64_t>(i));
    const int64_t start = thread_cpu_ns();
    const auto found =
        detector.run(scene.in_floor, eye_of(scene.camera_in_floor), [&] { return ms_since(start) < search_ms; });
    const double time_ms = ms_since(start);
    add(figures, detector.skeleton(), scene.body,
        {found, has_candidate(detector, scene.body), arm_points(detector.skeleton(), scene) < kArmPoints, time_ms,
         detector.searched()});
  }
  return figures;
}

Figures measure_any(const Skeleton& skeleton, const FitParameters& parameters, const SceneCamera& camera, uint64_t seed,
                    int trials) {
  const SegmentationParameters s;
  const auto range = static_cast<float>(s.range_m * s.range_m), low = static_cast<float>(s.floor_m);
  Figures figures;
  const auto rays = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
  Fitter fitter(skeleton, parameters, rays);
  cloud::VoxelGrid grid(rays);
  for (int i = 0; i < trials; ++i) {
    const GeneratedScene scene = make_any(skeleton, camera, seed, static_cast<uint64_t>(i));
    std::vector<Point> points;
    for (const Point& p : scene.in_floor)
      if (p.x * p.x + p.y * p.y < range && p.z > low) points.push_back(p);
    const int64_t start = thread_cpu_ns();
    grid.fill({points, {}}, s.voxel_m);
    points.clear();
    for (const cloud::Voxel& voxel : grid.voxels()) points.push_back(voxel.mean());
    const double density = reference_density(points, parameters.tube_m);
    const Cluster cluster{points, scene.body.joints[0].cast<float>(), density, eye_of(scene.camera_in_floor)};
    const Fit fit = fitter.fit(cluster, kWithoutEnd);
    const DetectedBody body{fit, 0, is_valid(skeleton, parameters, fit), 0};
    add(figures, skeleton, scene.body, {{&body, 1}, true, false, ms_since(start)});
  }
  return figures;
}

}  // namespace takt::body_pose
