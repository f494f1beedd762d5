// SPDX-License-Identifier: Apache-2.0
// Messages as the page shows them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "graph/ace/ace_registry.hpp"
#include "graph/language/message_types.hpp"
#include "graph/web/page_frames.hpp"
#include "graph/world/specimen.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/point_cloud.hpp"

using namespace takt;
using web::Json;

namespace {

/// A header and the bytes behind it.
struct Read {
  explicit Read(const web::Hub::Part& part) {
    const std::string& frame = *part.frame;
    uint32_t size = 0;
    REQUIRE(frame.size() >= sizeof size);
    std::memcpy(&size, frame.data(), sizeof size);
    REQUIRE(frame.size() >= sizeof size + size);
    head = Json::parse(frame.substr(sizeof size, size));
    bytes = frame.substr(sizeof size + size);
  }
  Json head;
  std::string bytes;
};

cv::Mat decoded(const std::string& bytes) {
  return cv::imdecode(std::vector<char>(bytes.begin(), bytes.end()), cv::IMREAD_UNCHANGED);
}

}  // namespace

TEST_CASE("a specimen of every type is whole, and shows what its output can show") {
  const Registry registry = ace_registry();
  std::map<std::string, std::vector<std::string>> kinds;
  const Capacity capacity{.width = 8, .height = 4, .channels = 3, .count = 5};
  for (const auto& [name, type] : graph::message_types(registry)) {
    const AlignedBytes message = world::specimen(*type, capacity);
    CHECK_MESSAGE(type->intact(message.get(), capacity), name);
    kinds[name] = web::kinds_of(*type, capacity);
    for (const std::string& kind : kinds[name])
      CHECK_MESSAGE(!web::page_frames(*type, message.get(), kind, {}).empty(), name);
  }
  CHECK(kinds["stereo_pair"] == std::vector<std::string>{"picture"});
  CHECK(kinds["disparity"] == std::vector<std::string>{"disparity"});
  CHECK(kinds["grid"] == std::vector<std::string>{"grid"});
  CHECK(kinds["laser_scan"] == std::vector<std::string>{"scan"});
  CHECK(kinds["point_cloud"] == std::vector<std::string>{"cloud"});
  CHECK(kinds["velocity_command"].empty());
}

TEST_CASE("a pair is two pictures, whose frames say whose they are") {
  const Capacity capacity{.width = 16, .height = 8, .channels = 1};
  const AlignedBytes memory = world::specimen(MessageType::of<StereoPair>(), capacity);
  auto& pair = *reinterpret_cast<StereoPair*>(memory.get());
  std::fill_n(pair.right.data(), pair.right.size, uint8_t{200});
  const web::Origin origin{"eye.pair", 7, 3'500'000'000, 1'000'000'000, 2, 4.5};
  const auto parts = web::page_frames(MessageType::of<StereoPair>(), memory.get(), "picture", origin);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].stamp_ns == 3'500'000'000);
  const Read left(parts[0]), right(parts[1]);
  CHECK(left.head == Json{{"port", "eye.pair"},
                          {"part", "left"},
                          {"kind", "picture"},
                          {"sequence", 7},
                          {"stamp_s", 2.5},
                          {"age_ms", 4.5},
                          {"level", 2},
                          {"width", 16},
                          {"height", 8}});
  CHECK(right.head["part"] == "right");
  CHECK(cv::mean(decoded(left.bytes))[0] < 3);
  CHECK(cv::mean(decoded(right.bytes))[0] == doctest::Approx(200).epsilon(0.02));
  CHECK(web::page_frames(MessageType::of<StereoPair>(), memory.get(), "cloud", origin).empty());
}

TEST_CASE("near things are bright in a disparity, and what has none is black") {
  const AlignedBytes memory = world::specimen(MessageType::of<DisparityMap>(), {.width = 16, .height = 16});
  auto& map = *reinterpret_cast<DisparityMap*>(memory.get());
  map.disparities = 64;
  for (size_t i = 0; i < map.disparity.size; ++i) map.disparity[i] = i < 128 ? int16_t{63} : int16_t{-1};
  const auto parts = web::page_frames(MessageType::of<DisparityMap>(), memory.get(), "disparity", {});
  REQUIRE(parts.size() == 1);
  const cv::Mat picture = decoded(Read(parts[0]).bytes);
  CHECK(picture.at<uint8_t>(1, 8) > 240);
  CHECK(picture.at<uint8_t>(14, 8) < 10);
}

TEST_CASE("a large cloud is thinned evenly, and says of how many points") {
  const AlignedBytes memory = world::specimen(MessageType::of<PointCloud>(), {.count = 100'000});
  auto& cloud = *reinterpret_cast<PointCloud*>(memory.get());
  for (size_t i = 0; i < cloud.points.size; ++i) cloud.points[i] = {static_cast<float>(i), 0, 1};
  const Read read(web::page_frames(MessageType::of<PointCloud>(), memory.get(), "cloud", {})[0]);
  const auto count = read.head["count"].get<size_t>();
  CHECK(read.head["of"] == 100'000);
  CHECK(count > 20'000);
  CHECK(count <= 30'000);
  REQUIRE(read.bytes.size() == 16 * count);
  float last = 0;
  std::memcpy(&last, read.bytes.data() + 16 * (count - 1), sizeof last);
  CHECK(last > 99'900);
}

TEST_CASE("a scan has its ranges and where they begin") {
  const AlignedBytes memory = world::specimen(MessageType::of<LaserScan>(), {.count = 3});
  auto& scan = *reinterpret_cast<LaserScan*>(memory.get());
  scan.range_m[1] = 2.5F;
  const Read read(web::page_frames(MessageType::of<LaserScan>(), memory.get(), "scan", {})[0]);
  REQUIRE(read.bytes.size() == 12);
  float range = 0;
  std::memcpy(&range, read.bytes.data() + 4, sizeof range);
  CHECK(range == 2.5F);
  CHECK(read.head.contains("first_angle_rad"));
}
