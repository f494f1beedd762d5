// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "tests/unit/mapping_3d/node_harness.hpp"

namespace takt {
void register_picture(NodeTypes& types);
}

using namespace takt;

TEST_CASE("picture: writes what it has seen when the run ends, and nothing else") {
  const auto folder = std::filesystem::temp_directory_path() / ("takt_picture_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  {
    NodeTypes types;
    register_picture(types);
    const auto node = types.find("picture")->make();
    for (ParamBase* p : node->params())
      if (p->name() == "directory") REQUIRE(p->set(std::string("pictures")));
      else if (p->name() == "track_points") REQUIRE(p->set(int64_t{16}));
    const Capacity size{40, 30, 1, 0};
    auto& map_port = test::input(*node, "disparity");
    auto& motion_port = test::input(*node, "motion");
    PortAccess::connect(map_port, size);
    PortAccess::connect(motion_port, {});
    auto& pair_port = test::input(*node, "pair");
    PortAccess::connect(pair_port, size);
    test::set_up(*node, folder);
    test::Box<DisparityMap> map(size);
    map->width = 40, map->height = 30, map->disparities = 20;
    map->disparity.resize(40 * 30);
    for (auto& d : map->disparity.items()) d = 19;
    test::latch(map_port, map, 1, 1);
    test::Box<StereoPair> pair(size);
    pair->width = 40, pair->height = 30, pair->channels = 1;
    pair->left.resize(40 * 30);
    for (auto& level : pair->left.items()) level = 77;
    test::latch(pair_port, pair, 1, 1);
    test::Box<Motion> motion;
    motion->valid = 1;
    for (uint64_t i = 1; i <= 100; ++i) {  // more than the track holds
      motion->pose.z = 0.1 * static_cast<double>(i);
      test::latch(motion_port, motion, static_cast<int64_t>(i), i);
      test::run(*node, i);
    }
    CHECK_FALSE(std::filesystem::exists(folder / "pictures"));  // no file before the end
    node->finish();
  }
  const cv::Mat disparity = cv::imread((folder / "pictures/disparity.png").string());
  CHECK(disparity.cols == 40);
  CHECK(disparity.rows == 30);
  if (!disparity.empty()) CHECK(disparity.at<cv::Vec3b>(3, 3)[2] > disparity.at<cv::Vec3b>(3, 3)[0]);
  const cv::Mat left = cv::imread((folder / "pictures/left.png").string(), cv::IMREAD_GRAYSCALE);
  CHECK(left.cols == 40);
  if (!left.empty()) CHECK(left.at<uint8_t>(29, 39) == 77);
  CHECK(!cv::imread((folder / "pictures/track.png").string()).empty());
  CHECK_FALSE(std::filesystem::exists(folder / "pictures/obstacles.png"));
  std::filesystem::remove_all(folder);
}
