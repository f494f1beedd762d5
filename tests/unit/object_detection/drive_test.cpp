// SPDX-License-Identifier: Apache-2.0
// The shipped database on the simulated robot's drive through the lab, against the world's ground truth.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/sim/simulation.hpp"
#include "nodes/object_detection/detector.hpp"
#include "rt/msg/ace/detections.hpp"
#include "tests/graph_folder.hpp"

using namespace takt;
using namespace takt::object_detection;

namespace {

const std::filesystem::path kGraph = takt::test::graph_folder();

struct Seen {
  double x = 0, y = 0;    ///< centre of the object, px
  double side = 0;        ///< of its front, px
  bool in_image = false;  ///< some of it may be visible
  bool whole = false;     ///< it is visible, whole and not hidden, at 0.8 times the reference's size or more
};

Seen look(const sim::WorldObject& object, const sim::CameraPose& pose, const StereoRig& rig,
          const std::vector<float>& depth) {
  const sim::Vec3 centre(object.position.x(), object.position.y(), object.box->z_m + object.box->height_m / 2);
  const sim::Vec3 p = pose.rotation.transpose() * (centre - pose.position);
  Seen seen;
  if (p.z() < 0.5) return seen;
  seen.x = rig.cu_px + rig.focal_px * p.x() / p.z();
  seen.y = rig.cv_px + rig.focal_px * p.y() / p.z();
  seen.side = rig.focal_px * object.box->height_m / p.z();
  const double reach = 0.75 * seen.side;
  seen.in_image = seen.x > -reach && seen.y > -reach && seen.x < rig.width + reach && seen.y < rig.height + reach;
  const bool inside = seen.x >= reach && seen.y >= reach && seen.x < rig.width - reach && seen.y < rig.height - reach;
  if (!inside) return seen;
  const size_t pixel = static_cast<size_t>(seen.y) * static_cast<size_t>(rig.width) + static_cast<size_t>(seen.x);
  seen.whole = std::abs(depth[pixel] - p.z()) < 0.5 && seen.side >= 0.8 * 46;
  return seen;
}

bool is_at(const Detection& box, const Seen& seen) {
  const double reach = seen.side / 2 + 32;
  return std::abs(box.x_px + 32 - seen.x) <= reach && std::abs(box.y_px + 32 - seen.y) <= reach;
}

}  // namespace

TEST_CASE("the boxes of the lab are found on the drive, at their places and nowhere else") {
  const auto world = sim::Simulation::load("camera", kGraph / "worlds/lab.xml", "", 1);
  REQUIRE(world);
  const StereoRig rig = *load_rig("camera", kGraph / "rigs/xb3.yaml");
  const auto database = read_database(kGraph / "objects", 48, TestViews::skip);
  DetectorParameters parameters;
  parameters.scales = {1, 0.7, 0.5};
  Detector detector(rig.width, rig.height, database, parameters);
  sim::Renderer renderer({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px});
  (*world)->begin(0);
  std::vector<uint8_t> image(static_cast<size_t>(rig.width * rig.height * 3));
  std::vector<float> depth(static_cast<size_t>(rig.width * rig.height));
  std::array<size_t, 4> visible{}, found{};
  REQUIRE(database.size() == visible.size());
  size_t elsewhere = 0, frames = 0;
  for (int64_t second = 0; second < 72; ++second, ++frames) {  // once around
    const sim::CameraPose pose = (*world)->camera_pose(rig, 0, second * 1'000'000'000);
    renderer.render((*world)->scene(), pose, {}, static_cast<uint64_t>(second),
                    {image.data(), rig.width, rig.height, 3}, depth.data());
    REQUIRE(detector.run({image.data(), rig.width, rig.height, 3}));
    std::array<Detection, 32> boxes;
    const size_t count = detector.detections(0.3, boxes);
    for (size_t o = 0; o < database.size(); ++o) {
      const auto& objects = (*world)->world().objects;
      const auto object =
          std::find_if(objects.begin(), objects.end(), [&](const auto& any) { return any.name == database[o].name; });
      REQUIRE(object != objects.end());
      const Seen seen = look(*object, pose, rig, depth);
      bool hit = false;
      for (size_t i = 0; i < count; ++i) {
        if (boxes[i].class_id != static_cast<float>(o)) continue;
        const bool here = seen.in_image && is_at(boxes[i], seen);
        hit = hit || here;
        elsewhere += !here;
      }
      visible[o] += seen.whole;
      found[o] += seen.whole && hit;
    }
  }
  for (size_t o = 0; o < database.size(); ++o) {
    MESSAGE(database[o].name << ": found in " << found[o] << " of " << visible[o] << " frames that show it whole");
    CHECK(visible[o] >= 5);
    CHECK(found[o] == visible[o]);
  }
  MESSAGE(elsewhere << " detections elsewhere in " << frames << " frames");
  CHECK(elsewhere <= 3);  // two were measured
}
