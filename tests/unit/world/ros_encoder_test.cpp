// SPDX-License-Identifier: Apache-2.0
#include "graph/world/ros_encoder.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "rt/msg/ace/detections.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "tests/unit/world/placed.hpp"
#include "tests/unit/world/ros_reader.hpp"

using namespace takt;
using namespace takt::world;
using test::Placed;

namespace {

using RosJson = test::RosReader::Json;
constexpr int64_t kWall_ns = 1'700'000'000'000'000'345;

/// Each form by its topic, decoded by its own definition.
template <class T>
std::map<std::string, RosJson> ros_forms(const T& message, const Wanted& wanted = {}) {
  std::map<std::string, RosJson> all;
  for (const Form& form : RosEncoder().forms(MessageType::of<T>(), &message, "eye", kWall_ns, wanted))
    all[form.topic] = test::RosReader(ros_definition(form.schema)).read(form.bytes);
  return all;
}

template <class T>
std::map<std::string, RosJson> ros_forms(Placed<T>& placed, const Wanted& wanted = {}) {
  return ros_forms(*placed.operator->(), wanted);
}

}  // namespace

TEST_CASE("a scan is as ROS 2 has it: no return is infinite, its frame looks along x") {
  Placed<LaserScan> scan({.count = 3});
  scan->first_angle_rad = -1, scan->step_rad = 1, scan->max_range_m = 8, scan->sweep_s = 0.25;
  scan->range_m.resize(3);
  scan->range_m[0] = 2, scan->range_m[1] = 0, scan->range_m[2] = 4;
  scan->sensor_in_robot = {.x = 0.5, .y = 2};
  const auto forms = ros_forms(scan);
  const RosJson& shown = forms.at("");
  CHECK(shown["header"]["frame_id"] == "eye");
  CHECK(shown["header"]["stamp"]["sec"] == 1'700'000'000);
  CHECK(shown["header"]["stamp"]["nanosec"] == 345);
  CHECK(shown["angle_min"] == -1.0);
  CHECK(shown["angle_max"] == 1.0);
  CHECK(shown["time_increment"] == 0.125);
  CHECK(shown["range_max"] == 8.0);
  CHECK(shown["ranges"][0] == 2.0);
  CHECK(std::isinf(shown["ranges"][1].get<double>()));
  const RosJson& mount = forms.at("/tf")["transforms"][0];
  CHECK(mount["header"]["frame_id"] == "robot");
  CHECK(mount["child_frame_id"] == "eye");
  CHECK(mount["transform"]["translation"]["y"] == 2.0);
  CHECK(mount["transform"]["rotation"]["z"].get<double>() == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE("a picture is offered raw and as JPEG, and made only as it is wanted") {
  Placed<Image> image({.width = 16, .height = 8, .channels = 1});
  image->width = 16, image->height = 8, image->channels = 1;
  image->pixels.resize(128);
  image->pixels[17] = 9;
  image->camera = {100, 8, 4, 0.25};
  const auto raw = ros_forms(image, [](std::string_view topic) { return topic == "image_raw"; });
  CHECK(raw.size() == 1);
  CHECK(raw.at("image_raw")["encoding"] == "mono8");
  CHECK(raw.at("image_raw")["step"] == 16);
  CHECK(raw.at("image_raw")["data"][17] == 9);
  const auto all = ros_forms(image);
  CHECK(all.at("image_raw/compressed")["format"] == "jpeg");
  CHECK(all.at("image_raw/compressed")["data"][0] == 0xff);  // SOI
  CHECK(all.at("camera_info")["k"][0] == 100.0);
  const auto outlines = RosEncoder().outline(MessageType::of<Image>(), image.get());
  CHECK(outlines.size() == 3);
}

TEST_CASE("odometry has speeds and a transform; a pose looks along x, with its covariance") {
  Odometry odometry{.x_m = 1, .y_m = 2, .theta_rad = std::numbers::pi / 2, .speed_m_s = 0.5, .turn_rad_s = -0.25};
  const auto forms = ros_forms(odometry);
  CHECK(forms.at("")["header"]["frame_id"] == "odom");
  CHECK(forms.at("")["child_frame_id"] == "base_link");
  CHECK(forms.at("")["twist"]["twist"]["linear"]["x"] == 0.5);
  CHECK(forms.at("")["twist"]["twist"]["angular"]["z"] == -0.25);
  CHECK(forms.at("/tf")["transforms"][0]["transform"]["translation"]["y"] == 2.0);

  Pose pose;
  pose.transform.x = 3;
  pose.covariance[35] = 0.125;
  const auto shown = ros_forms(pose).at("");
  CHECK(shown["header"]["frame_id"] == "map");
  CHECK(shown["pose"]["covariance"][35] == 0.125);
  CHECK(shown["pose"]["pose"]["orientation"]["z"].get<double>() == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE("a grid is in percent, a cloud has rgb, boxes have their middle") {
  Placed<Grid> grid({.width = 3, .height = 2});
  grid->width = 3, grid->height = 2, grid->cell_m = 0.25, grid->origin_x_m = -1;
  grid->cells.resize(6);
  const int16_t cells[]{0, 1000, -1, 504, 505, 4};
  std::copy(std::begin(cells), std::end(cells), grid->cells.data());
  const auto shown = ros_forms(grid).at("");
  CHECK(shown["data"] == RosJson::array({0, 100, -1, 50, 51, 0}));
  CHECK(shown["info"]["width"] == 3);
  CHECK(shown["info"]["origin"]["position"]["x"] == -1.0);

  Placed<PointCloud> cloud({.count = 2});
  cloud->points.resize(2), cloud->colours.resize(1);
  cloud->points[1] = {1, 2, 3};
  cloud->colours[0] = {.b = 1, .g = 2, .r = 3};
  const auto points = ros_forms(cloud).at("");
  CHECK(points["width"] == 2);
  CHECK(points["row_step"] == 32);
  CHECK(points["data"][12] == 1);
  CHECK(points["data"][14] == 3);
  CHECK(points["data"][28] == 255);  // white

  Placed<Detections> found({.count = 1});
  found->boxes.resize(1);
  found->boxes[0] = {4, 10, 20, 6, 8, 0.5f};
  const auto boxes = ros_forms(found).at("")["detections"];
  CHECK(boxes[0]["bbox"]["center"]["position"]["x"] == 13.0);
  CHECK(boxes[0]["results"][0]["hypothesis"]["class_id"] == "4");
}

TEST_CASE("what Takt calls right and ahead, ROS 2 calls ahead and left") {
  const Transform ahead = chained(ros_frame::kTaktInRos, {.y = 1});
  CHECK(ahead.x == doctest::Approx(1));
  CHECK(ahead.y == doctest::Approx(0));
  const Transform none = chained(ros_frame::kTaktInRos, ros_frame::kRosInTakt);
  CHECK(none.qw == doctest::Approx(1));
  const Transform there = chained({.x = 1, .qw = std::sqrt(0.5), .qz = std::sqrt(0.5)}, {.x = 2, .y = 3});
  const Transform back = chained(inverted({.x = 1, .qw = std::sqrt(0.5), .qz = std::sqrt(0.5)}), there);
  CHECK(back.x == doctest::Approx(2));
  CHECK(back.y == doctest::Approx(3));
}
