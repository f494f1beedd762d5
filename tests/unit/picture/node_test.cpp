// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <filesystem>
#include <initializer_list>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/temporary_folder.hpp"

namespace takt {
void register_picture(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr Capacity kSize{40, 30, 1, 0};

/// The node with some inputs connected, writing to a folder of the test's own.
struct PictureBench {
  test::TemporaryFolder folder;
  std::unique_ptr<Node> node;

  explicit PictureBench(std::initializer_list<const char*> connected,
                        const std::vector<std::pair<std::string, ParamValue>>& params = {}) {
    NodeTypes types;
    register_picture(types);
    node = types.find("picture")->make();
    for (const auto& [name, value] : params) test::set(*node, name, value);
    for (const char* port : connected) PortAccess::connect(test::input(*node, port), {kSize.width, kSize.height, 1, 8});
    test::set_up(*node, folder.path);
  }
  InputPort& port(std::string_view name) { return test::input(*node, name); }
  cv::Mat read(const char* name) const { return cv::imread((folder.path / name).string()); }
  bool wrote(const char* name) const { return std::filesystem::exists(folder.path / name); }
};

struct GreyPair : test::Box<StereoPair> {
  explicit GreyPair(uint8_t level) : Box(kSize) {
    (*this)->width = 40, (*this)->height = 30, (*this)->channels = 1;
    (*this)->left.resize(40 * 30);
    for (auto& pixel : (*this)->left.items()) pixel = level;
  }
};

struct OneDetection : test::Box<Detections> {
  OneDetection() : Box({0, 0, 1, 8}) {
    (*this)->boxes.resize(1);
    (*this)->boxes[0] = {3, 10, 5, 25, 20, 0.8f};
  }
};

cv::Vec3b grey(uint8_t level) { return {level, level, level}; }

}  // namespace

TEST_CASE("picture: boxes are drawn on the image of their stamp, not on a newer one") {
  PictureBench bench({"pair", "detections"});
  GreyPair older(50), newer(90);
  OneDetection boxes;
  test::latch(bench.port("detections"), boxes, 100, 1);
  test::latch(bench.port("pair"), older, 100, 1, 0);
  test::latch(bench.port("pair"), newer, 200, 2, 1);
  test::run(*bench.node);
  bench.node->finish();
  const cv::Mat left = bench.read("left.png");
  REQUIRE(left.cols == 40);
  CHECK(left.at<cv::Vec3b>(1, 1) == grey(50));
  CHECK(left.at<cv::Vec3b>(15, 10) != grey(50));  // the frame
}

TEST_CASE("picture: without detections of any latched image the newest one is written, without boxes") {
  PictureBench bench({"pair", "detections"});
  GreyPair first(50), second(90);
  OneDetection boxes;
  test::latch(bench.port("detections"), boxes, 100, 1);
  test::latch(bench.port("pair"), first, 100, 1);
  test::run(*bench.node);
  test::latch(bench.port("pair"), second, 900, 2);
  test::run(*bench.node, 1);
  bench.node->finish();
  const cv::Mat left = bench.read("left.png");
  REQUIRE(left.cols == 40);
  CHECK(cv::norm(left, cv::Mat(30, 40, CV_8UC3, cv::Scalar(90, 90, 90)), cv::NORM_INF) == 0);
}

TEST_CASE("picture: the ground mask lies over the image of its stamp; one without its image is not drawn") {
  PictureBench bench({"ground_pair", "mask", "ground"});
  GreyPair first(60), second(100);
  test::Box<Image> mask(kSize);
  mask->width = 40, mask->height = 30, mask->channels = 1;
  mask->pixels.resize(40 * 30);
  for (int i = 0; i < 40 * 30; ++i) mask->pixels[static_cast<uint32_t>(i)] = i >= 40 * 20 ? 255 : 0;
  test::Box<Grid> grid({2, 1, 1, 0});
  grid->width = 2, grid->height = 1;
  grid->cells.resize(2);
  grid->cells[0] = 0, grid->cells[1] = 1000;
  test::latch(bench.port("mask"), mask, 100, 1);
  test::latch(bench.port("ground_pair"), first, 100, 1, 0);
  test::latch(bench.port("ground_pair"), second, 200, 2, 1);
  test::latch(bench.port("ground"), grid, 100, 1);
  test::run(*bench.node);
  test::latch(bench.port("mask"), mask, 300, 2);
  test::run(*bench.node, 1);
  bench.node->finish();
  const cv::Mat ground = bench.read("ground.png"), map = bench.read("ground_map.png");
  REQUIRE(ground.cols == 40);
  CHECK(ground.at<cv::Vec3b>(5, 5) == grey(60));
  CHECK(ground.at<cv::Vec3b>(25, 20)[1] > ground.at<cv::Vec3b>(25, 20)[0]);
  REQUIRE(map.cols == 600);
  CHECK(map.at<cv::Vec3b>(0, 0) == grey(255));
  CHECK(map.at<cv::Vec3b>(0, 599) == grey(0));
  CHECK_FALSE(bench.wrote("left.png"));
}

TEST_CASE("picture: laser points lie in their colours beside their match probabilities; each grid has its file") {
  PictureBench bench({"coloured", "match", "merged", "traversability", "ground", "terrain"});
  test::Box<PointCloud> coloured({0, 0, 1, 8}), match({0, 0, 1, 8});
  for (int i = 0; i < 5; ++i)
    for (auto& [cloud, colour] : {std::pair(&coloured, Colour{255, 0, 0}), std::pair(&match, Colour{0, 255, 0})}) {
      (*cloud)->points.push_back({static_cast<float>(i), static_cast<float>(i), 0});
      (*cloud)->colours.push_back(colour);
    }
  test::Box<Grid> blocked({1, 1, 1, 0}), free({1, 1, 1, 0});
  for (auto* grid : {&blocked, &free}) {
    (*grid)->width = (*grid)->height = 1;
    (*grid)->cells.resize(1);
  }
  blocked->cells[0] = 1000, free->cells[0] = 0;
  test::Box<Terrain> terrain;
  terrain->kind = terrain_kind::crossing;
  test::latch(bench.port("coloured"), coloured, 1, 1);
  test::latch(bench.port("match"), match, 1, 1);
  test::latch(bench.port("merged"), blocked, 1, 1);
  test::latch(bench.port("traversability"), free, 1, 1);
  test::latch(bench.port("ground"), free, 1, 1);
  test::latch(bench.port("terrain"), terrain, 1, 1);
  test::run(*bench.node);
  bench.node->finish();
  const cv::Mat laser = bench.read("laser.png");
  REQUIRE(laser.cols == 2 * laser.rows / 2);  // two clouds side by side, two views each
  cv::Mat planes[3];
  cv::split(laser(cv::Rect(0, 0, laser.cols / 2, laser.rows)), planes);
  CHECK(cv::countNonZero(planes[0]) > 10);  // blue
  CHECK(cv::countNonZero(planes[1]) == 0);
  cv::split(laser(cv::Rect(laser.cols / 2, 0, laser.cols / 2, laser.rows)), planes);
  CHECK(cv::countNonZero(planes[0]) == 0);
  CHECK(cv::countNonZero(planes[1]) > 10);  // green
  CHECK(bench.read("merged.png").at<cv::Vec3b>(0, 0) == grey(0));
  CHECK(bench.read("traversability.png").at<cv::Vec3b>(0, 0) == grey(255));
  const cv::Mat ground = bench.read("ground_map.png");
  cv::split(ground, planes);
  CHECK(cv::countNonZero(planes[2] != planes[0]) > 100);  // the word on it
}

TEST_CASE("picture: a job allocates nothing") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  PictureBench bench({"pair", "detections", "motion", "ground_pair", "mask", "ground"});
  GreyPair pair(60);
  test::Box<Detections> boxes({0, 0, 1, 8});
  boxes->boxes.resize(8);
  test::latch(bench.port("detections"), boxes, 100, 1);
  test::latch(bench.port("pair"), pair, 100, 1);
  const uint64_t before = thread_memory_use().allocations;
  test::run(*bench.node);
  CHECK(thread_memory_use().allocations == before);
}

TEST_CASE("picture: writes what it has seen when the run ends, and nothing else") {
  PictureBench bench({"disparity", "motion", "pair"},
                     {{"directory", std::string("pictures")}, {"track_points", int64_t{16}}});
  test::Box<DisparityMap> map(kSize);
  map->width = 40, map->height = 30, map->disparities = 20;
  map->disparity.resize(40 * 30);
  for (auto& d : map->disparity.items()) d = 19;
  test::latch(bench.port("disparity"), map, 1, 1);
  GreyPair pair(77);
  test::latch(bench.port("pair"), pair, 1, 1);
  test::Box<Motion> motion;
  motion->valid = 1;
  for (uint64_t i = 1; i <= 100; ++i) {  // more than the track holds
    motion->pose.z = 0.1 * static_cast<double>(i);
    test::latch(bench.port("motion"), motion, static_cast<int64_t>(i), i);
    test::run(*bench.node, i);
  }
  CHECK_FALSE(bench.wrote("pictures"));  // no file before the end
  bench.node->finish();
  const cv::Mat disparity = bench.read("pictures/disparity.png"), left = bench.read("pictures/left.png");
  REQUIRE(disparity.cols == 40);
  CHECK(disparity.rows == 30);
  CHECK(disparity.at<cv::Vec3b>(3, 3)[2] > disparity.at<cv::Vec3b>(3, 3)[0]);
  REQUIRE(left.cols == 40);
  CHECK(left.at<cv::Vec3b>(29, 39) == grey(77));
  CHECK(bench.wrote("pictures/track.png"));
  CHECK_FALSE(bench.read("pictures/track.png").empty());
  CHECK_FALSE(bench.wrote("pictures/obstacles.png"));
}
