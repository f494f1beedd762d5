// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <initializer_list>
#include <opencv2/imgcodecs.hpp>

#include "rt/memory/memory_use.hpp"
#include "tests/unit/mapping_3d/node_harness.hpp"

namespace takt {
void register_picture(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr Capacity kSize{40, 30, 1, 0};

/// The node with some inputs connected, writing to a folder of the test's own.
struct Bench {
  std::filesystem::path folder;
  std::unique_ptr<Node> node;

  explicit Bench(std::initializer_list<const char*> connected) {
    std::string name = (std::filesystem::temp_directory_path() / "picture-XXXXXX").string();
    folder = mkdtemp(name.data());
    NodeTypes types;
    register_picture(types);
    node = types.find("picture")->make();
    for (const char* port : connected) PortAccess::connect(test::input(*node, port), {kSize.width, kSize.height, 1, 8});
    test::set_up(*node, folder);
  }
  ~Bench() { std::filesystem::remove_all(folder); }
  InputPort& port(std::string_view name) { return test::input(*node, name); }
  cv::Mat read(const char* name) const { return cv::imread((folder / name).string()); }
};

struct GreyPair : test::Box<StereoPair> {
  explicit GreyPair(uint8_t level) : Box(kSize) {
    (*this)->width = 40, (*this)->height = 30, (*this)->channels = 1;
    (*this)->left.resize(40 * 30);
    for (auto& pixel : (*this)->left.items()) pixel = level;
  }
};

cv::Vec3b grey(uint8_t level) { return {level, level, level}; }

}  // namespace

TEST_CASE("picture: boxes are drawn on the image of their stamp, not on a newer one") {
  Bench bench({"pair", "detections"});
  GreyPair older(50), newer(90);
  test::Box<Detections> boxes({0, 0, 1, 8});
  boxes->boxes.resize(1);
  boxes->boxes[0] = {3, 10, 5, 25, 20, 0.8f};
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
  Bench bench({"pair", "detections"});
  GreyPair first(50), second(90);
  test::Box<Detections> boxes({0, 0, 1, 8});
  boxes->boxes.resize(1);
  boxes->boxes[0] = {3, 10, 5, 25, 20, 0.8f};
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
  Bench bench({"ground_pair", "mask", "ground"});
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
  CHECK_FALSE(std::filesystem::exists(bench.folder / "left.png"));
}

TEST_CASE("picture: a job allocates nothing") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  Bench bench({"pair", "detections", "motion", "ground_pair", "mask", "ground"});
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
