// SPDX-License-Identifier: Apache-2.0
// Camera, stereo and signs in a graph, in virtual time: the robot of graph/worlds/crossing.xml drives towards three
// signs.
#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "nodes/traffic_signs/sign_drawing.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;
using namespace takt::traffic_signs;

namespace {

struct Seen {
  int messages = 0;
  std::array<int, kSignShapes.size()> of_class{};
  int placed = 0, near_truth = 0;
};

class SignProbe final : public Node {
 public:
  Seen seen;

  void setup(Setup&) override {}
  void run(Job&) override {
    const Detections* found = detections_.newest();
    const PointCloud* places = places_.newest();
    if (found == nullptr || places == nullptr || !detections_.is_new()) return;
    ++seen.messages;
    for (uint32_t i = 0; i < found->boxes.size; ++i) {
      ++seen.of_class[static_cast<size_t>(found->boxes[i].class_id)];
      const Point& place = places->points[i];
      if (!std::isfinite(place.z)) continue;
      ++seen.placed;
      // The signs hang at x = 14.9 m; in its first four seconds the robot drives from x = 3 m to at most 6.5 m. A
      // disparity is a whole number, here of 10 to 14 px.
      const float distance_m = std::hypot(place.x, place.y, place.z);
      seen.near_truth += distance_m > 7.9f && distance_m < 13.0f;
    }
  }

 private:
  Input<Detections> detections_{this, "detections", ""};
  Input<PointCloud> places_{this, "places", ""};
};

constexpr test::DriveGraph kGraph{
    .devices = R"(
  head_camera: {kind: stereo_camera, rig: @/rigs/xb3.yaml, rate: 5}
)",
    .nodes = R"(
    stereo: {type: stereo, in: {pair: head_camera.pair}, params: {disparities: 128}}
    traffic_signs:
      type: traffic_signs
      in: {pair: stereo.rectified, disparity: stereo.disparity}
      join: [pair, disparity]
      params: {budget: 1s}  # the signs are those of the share folder, not beside this graph
    probe:
      type: probe
      in: {detections: traffic_signs.detections, places: traffic_signs.places}
      join: [detections, places]
)",
    .schedule = R"(
  head_camera: {rate: 5, budget: 8ms, criticality: high}
  stereo: {rate: 5, offset: 26ms, budget: 20ms, criticality: high}
  traffic_signs: {rate: 5, offset: 90ms, budget: 40ms}
  probe: {rate: 5, offset: 180ms, budget: 1ms}
)",
    .world = "crossing",
};

}  // namespace

TEST_CASE("traffic_signs in a graph: three signs of a simulated yard by their names, with their distances") {
  const test::Drive<SignProbe> drive(kGraph, 4'000'000'000);
  const Seen& seen = drive.probe().seen;
  CHECK(seen.messages >= 18);
  const auto of = [&](SignClass sign) { return seen.of_class[static_cast<size_t>(sign)]; };
  CHECK(of(SignClass::stop) >= 12);
  CHECK(of(SignClass::yield) >= 6);
  CHECK(of(SignClass::arrow_right) >= 6);
  CHECK(of(SignClass::priority) + of(SignClass::arrow_left) + of(SignClass::one_way) <= 2);  // none of these is in view
  CHECK(seen.placed >= 24);
  CHECK(10 * seen.near_truth >= 9 * seen.placed);
}
