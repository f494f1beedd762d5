// SPDX-License-Identifier: Apache-2.0
// The node in a graph of its own, in virtual time: pairs of clouds in, poses and coloured laser points out.
#include <doctest/doctest.h>

#include "nodes/laser_fusion/evaluate.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;
using namespace takt::laser_fusion;

namespace {

constexpr uint64_t kScene = 5;
constexpr PairParameters kPair{.points = 500, .offset_m = 0.3, .offset_rad = 0.3};

struct Seen {
  size_t poses = 0, clouds = 0, right = 0, points = 0;
};

/// Shows the same scene all the time.
class Robot final : public Node {
 public:
  Seen seen;

  void setup(Setup&) override {
    pair_ = generate_pair(kPair, kScene);
    laser_.reserve({0, 0, 1, 500});
    vision_.reserve({0, 0, 1, 500});
  }
  void run(Job& job) override {
    if (pose_.is_new()) {
      ++seen.poses;
      last_ = ego_motion::from_transform(pose_.newest()->transform);
    }
    if (fused_.is_new()) {
      ++seen.clouds;
      seen.points += fused_.newest()->points.size;
      seen.right += error_of(last_, pair_.vision_in_laser).success();
    }
    PointCloud *laser = laser_.loan(), *vision = vision_.loan();
    if (!laser || !vision) return job.no_result();
    for (const Point& p : pair_.laser.points) laser->points.push_back(p);
    for (const Point& p : pair_.vision.points) vision->points.push_back(p);
    for (const Colour& c : pair_.vision.colours) vision->colours.push_back(c);
    laser_.send(job.release_ns());
    vision_.send(job.release_ns());
  }

 private:
  CloudPair pair_;
  Rigid last_;
  Input<Pose> pose_{this, "pose", ""};
  Input<PointCloud> fused_{this, "fused", ""};
  Output<PointCloud> laser_{this, "laser", ""}, vision_{this, "vision", ""};
};

constexpr test::DriveGraph kGraph{
    .devices = R"(
  base: {kind: mobile_base, rate: 5}
)",
    .nodes = R"(
    probe: {type: probe, in: {pose: laser_fusion.pose, fused: laser_fusion.fused}}
    laser_fusion: {type: laser_fusion, in: {laser: probe.laser, vision: probe.vision}, params: {generations: 3000, per_job: 500}}
)",
    .schedule = R"(
  base: {rate: 5, budget: 1ms}
  probe: {rate: 5, offset: 5ms, budget: 5ms, criticality: high}
  laser_fusion: {rate: 5, offset: 20ms, budget: 50ms}
)",
};

}  // namespace

TEST_CASE("laser_fusion at 5 Hz in a graph: six jobs a pair, each tells a pose, the last one a cloud") {
  const test::Drive<Robot> drive(kGraph, 4'000'000'000);
  const Seen& seen = drive.probe().seen;
  CHECK(seen.poses >= 17);
  CHECK(seen.clouds >= 2);
  CHECK(seen.right == seen.clouds);
  CHECK(seen.points > 300 * seen.clouds);
}
