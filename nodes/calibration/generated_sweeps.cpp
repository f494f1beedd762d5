// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/generated_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/laser_fusion/evaluate.hpp"
#include "nodes/laser_fusion/generated_room.hpp"

namespace takt::calibration {
namespace {

using namespace laser_fusion;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kPillar_m = 1.2, kPillarWidth_m = 0.3, kPillarAway_m = 1.2, kFree_m = 2.4, kFarthest_m = 8;
constexpr double kOffCentre = 0.3;  // of what rooms have: the pillar stays clear of the walls

constexpr double radians(double degrees) { return degrees * kPi / 180; }

/// The pillar is the last box.
std::vector<RoomBox> room_with_pillar(Generator& random) {
  std::vector<RoomBox> room = make_room(0, random);
  room.front().centre.head<2>() *= kOffCentre;
  room.erase(std::remove_if(room.begin() + 1, room.end(),
                            [](const RoomBox& box) { return box.centre.head<2>().norm() < kFree_m; }),
             room.end());
  const Eigen::Vector2d place = kPillarAway_m * direction_of(random.uniform(-kPi, kPi));
  room.push_back({{place.x(), place.y(), kPillar_m / 2},
                  {kPillarWidth_m / 2, kPillarWidth_m / 2, kPillar_m / 2},
                  direction_of(random.uniform(0, kPi)),
                  {}});
  return room;
}

std::vector<LaserReturn> sweep_of(const std::vector<RoomBox>& room, const Rigid& mount, const BeamAngles& beams,
                                  const GeneratedSweepParameters& p, Generator& random) {
  std::vector<LaserReturn> returns;
  for (int h = 0; h < p.headings; ++h) {
    const double heading = 2 * kPi * h / p.headings;
    const Rigid scanner =
        Rigid{Eigen::AngleAxisd(heading, Vector3d::UnitZ()).toRotationMatrix(), Vector3d::Zero()} * mount;
    for (int b = 0; b < p.beams; ++b) {
      LaserReturn r{heading, beams.first_rad + b * beams.step_rad, 1, false};
      const RayHit hit = first_hit(room, scanner.t, scanner.R * in_scanner(r));
      if (hit.range_m > kFarthest_m) continue;
      r.range_m = hit.range_m + random.normal(p.noise_m);
      r.on_object = hit.box + 1 == room.size();
      returns.push_back(r);
    }
  }
  return returns;
}

void add(const Rigid& found, const Rigid& truth, MountErrors& errors) {
  const PoseError error = error_of(found, truth);
  errors.position_m.push_back(error.m);
  errors.rotation_rad.push_back(error.rad);
}

}  // namespace

GeneratedSweeps generate_sweeps(const GeneratedSweepParameters& p, uint64_t seed) {
  constexpr PoseParameters kSpread{0.1, 0.1, 0.05, radians(10), radians(5), radians(5)};
  constexpr PoseParameters kNominal[] = {{-0.2, 0.15, 0.9, 0, 0, radians(45)}, {0.2, 0.15, 0.9, 0, 0, radians(-45)}};
  Generator random(seed);
  const std::vector<RoomBox> room = room_with_pillar(random);
  GeneratedSweeps out;
  out.recording.object_height_m = kPillar_m;
  out.beams = {-kPi / 2, kPi / (p.beams - 1)};
  for (const PoseParameters& nominal : kNominal) {
    const bool reference = out.truth.empty();
    PoseParameters truth = nominal, known = nominal;
    for (size_t i = 0; i < 6; ++i) truth[i] += random.uniform(-kSpread[i], kSpread[i]);
    if (reference)
      for (const Parameter exact : {kX, kY, kYaw, kPitch}) known[exact] = truth[exact];
    out.truth.push_back(truth);
    out.recording.sweeps.push_back(
        {reference ? "left" : "right", known, sweep_of(room, to_rigid(truth), out.beams, p, random)});
  }
  return out;
}

CalibrationErrors measure_calibration(const GeneratedSweepParameters& p, size_t runs, uint64_t seed) {
  CalibrationErrors out;
  for (size_t run = 0; run < runs; ++run) {
    const GeneratedSweeps generated = generate_sweeps(p, seed + run);
    const std::vector<CalibratedScanner> found = calibrate_lasers(generated.recording, {});
    const Rigid left = to_rigid(found[0].mount), right = to_rigid(found[1].mount);
    const Rigid true_left = to_rigid(generated.truth[0]), true_right = to_rigid(generated.truth[1]);
    add(left, true_left, out.reference);
    add(right, true_right, out.second);
    add(left.inverse() * right, true_left.inverse() * true_right, out.between);
    out.residual_m.push_back(found[1].residual_m);
    out.converged += found[0].converged && found[1].converged;
  }
  return out;
}

}  // namespace takt::calibration
