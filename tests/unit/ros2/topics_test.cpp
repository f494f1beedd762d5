// SPDX-License-Identifier: Apache-2.0
#include "graph/ros2/topics.hpp"

#include <doctest/doctest.h>

#include <cstring>

#include "graph/ros2/diagnostics.hpp"
#include "graph/world/ros_schemas.hpp"
#include "tests/hex.hpp"

using namespace takt;
using namespace takt::ros2;

TEST_CASE("types have the hashes that ROS 2 Jazzy computes for them") {
  // As installations print them (`ros2 topic info --verbose`).
  const std::pair<const char*, const char*> kHashes[]{
      {"std_msgs/msg/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
      {"sensor_msgs/msg/Image", "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
      {"sensor_msgs/msg/CompressedImage", "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"},
      {"sensor_msgs/msg/CameraInfo", "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
      {"sensor_msgs/msg/LaserScan", "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"},
      {"nav_msgs/msg/Odometry", "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
      {"tf2_msgs/msg/TFMessage", "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"}};
  for (const auto& [schema, hash] : kHashes) CHECK(type_hash(schema) == hash);
}

TEST_CASE("topics, types and profiles are spelled as ROS 2's middleware spells them") {
  const world::Outline outlines[]{{"left/image_raw", "sensor_msgs/msg/Image"},
                                  {"left/image_raw/compressed", "sensor_msgs/msg/CompressedImage"},
                                  {"left/camera_info", "sensor_msgs/msg/CameraInfo"},
                                  {"/tf", "tf2_msgs/msg/TFMessage"}};
  const auto topics = [&](Pictures pictures) {
    std::string all;
    for (const Publication& p : publications("/robot_1", "head_camera.pair", outlines, pictures)) all += p.topic + "\n";
    return all;
  };
  CHECK(topics(Pictures::compressed) ==
        "/robot_1/takt/head_camera/pair/left/image_raw/compressed\n"
        "/robot_1/takt/head_camera/pair/left/camera_info\n/tf\n");
  CHECK(topics(Pictures::image) ==
        "/robot_1/takt/head_camera/pair/left/image_raw\n/robot_1/takt/head_camera/pair/left/camera_info\n/tf\n");
  CHECK(publications("", "a.b", outlines, Pictures::both).size() == 4);

  const world::Outline disparity{"image_raw", "sensor_msgs/msg/Image"};  // which has no JPEG
  CHECK(publications("", "stereo.disparity", {&disparity, 1}, Pictures::compressed).size() == 1);

  const auto scan = endpoint_of({"", "/takt/front_laser/scan", "sensor_msgs/msg/LaserScan", {}});
  CHECK(scan.topic == "rt/takt/front_laser/scan");
  CHECK(scan.type == "sensor_msgs::msg::dds_::LaserScan_");
  CHECK(scan.user_data.starts_with("typehash=RIHS01_64c19139"));
  CHECK(scan.user_data.ends_with(";"));

  CHECK(words(profile_of("sensor_msgs/msg/LaserScan", "/takt/a/b")) == "best effort, volatile, keep last 1");
  CHECK(words(profile_of("nav_msgs/msg/OccupancyGrid", "/takt/a/b")) == "reliable, transient local, keep last 1");
  CHECK(words(profile_of("nav_msgs/msg/Odometry", "/takt/a/b")) == "reliable, volatile, keep last 10");
  CHECK(words(profile_of("tf2_msgs/msg/TFMessage", "/tf")) == "reliable, volatile, keep last 100");
  CHECK(words(profile_of("tf2_msgs/msg/TFMessage", "/tf_static")) == "reliable, transient local, keep last 1");
}

TEST_CASE("a namespace is one of ROS 2") {
  for (const char* good : {"", "/a", "/robot_1", "/site/Robot2"}) CHECK(is_namespace(good));
  for (const char* bad : {"a", "/", "/a/", "//a", "/1a", "/a b", "/a-b", "/a/2"}) CHECK_FALSE(is_namespace(bad));
}

TEST_CASE("the graph of ROS 2 is told of one node with its writers, byte by byte") {
  const dds::Guid participant{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0, 1, 0xc1}, writer{0xaa};
  const std::vector<std::byte> cdr = entities("", participant, {&writer, 1});
  const std::vector<uint8_t> expected = test::bytes_of_hex(
      "00010000 0102030405060708090a0b0c000001c1"               // gid
      "01000000 02000000 2f00 0000 05000000 74616b7400 000000"  // one node: "/", "takt"
      "00000000 01000000 aa000000000000000000000000000000");    // no reader, one writer
  REQUIRE(cdr.size() == expected.size());
  CHECK(std::memcmp(cdr.data(), expected.data(), cdr.size()) == 0);
}

TEST_CASE("a node that has missed deadlines since the last time is a warning, a lost device an error") {
  Diagnostics diagnostics({{"name", "ace"}, {"nodes", {{{"name", "stereo"}}}}});
  const auto level = [&](uint64_t misses, const char* device) {
    const std::vector<std::byte> cdr =
        diagnostics.of({{"nodes", {{{"deadline_misses", misses}, {"skipped", 0}}}},
                        {"devices", {{{"name", "laser"}, {"state", device}, {"trouble", "no line"}}}}},
                       1'500'000'000);
    // Header of 16 bytes with an empty frame behind that of CDR, the number of statuses, then the first one's level.
    constexpr size_t kFirstLevel = 4 + 8 + 4 + 4 + 4;
    REQUIRE(cdr.size() > kFirstLevel);
    return std::pair(std::to_integer<int>(cdr[kFirstLevel]), cdr.size());
  };
  CHECK(level(0, "ok").first == 0);
  CHECK(level(2, "ok").first == 1);
  CHECK(level(2, "lost").first == 0);  // no more of them
}
