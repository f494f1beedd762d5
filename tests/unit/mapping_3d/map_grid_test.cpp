// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/map_grid.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "nodes/mapping_3d/grid_file.hpp"
#include "nodes/mapping_3d/sliding_grid.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/point.hpp"
#include "rt/testing.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::mapping_3d;

TEST_CASE("fusion: the larger counts and unknown yields, from a finer, a coarser and a turned grid") {
  for (const double other_cell : {0.05, 0.45}) {
    CAPTURE(other_cell);
    test::Box<Grid> other({20, 20, 1, 0});
    other->width = other->height = 20;
    other->cell_m = other_cell;
    other->origin_x_m = other->origin_y_m = -10 * other_cell;
    other->grid_in_map = {1, 2, 0, std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // turned by 90 degrees
    REQUIRE(other->cells.resize(400));
    std::fill_n(other->cells.data(), 400, kUnknown);
    other->view().at(13, 10) = kOccupied;  // 3.5 cells along its x: the map's y
    other->view().at(6, 10) = kFree;
    test::Box<Grid> into({60, 60, 1, 0});
    into->width = into->height = 60;
    into->cell_m = 0.15;
    into->origin_x_m = into->origin_y_m = -3;
    REQUIRE(into->cells.resize(3600));
    std::fill_n(into->cells.data(), 3600, kUnknown);
    const auto at = [&](double x, double y) -> int16_t& {
      return into->view().at(static_cast<int>(std::floor((x + 3) / 0.15)),
                             static_cast<int>(std::floor((y + 3) / 0.15)));
    };
    const double x = 1 - 0.5 * other_cell, blocked_y = 2 + 3.5 * other_cell, free_y = 2 - 3.5 * other_cell;
    fuse(view_of(*other), *into);
    CHECK(at(x, blocked_y) == kOccupied);
    CHECK(at(x, free_y) == kFree);
    CHECK(at(x + 2 * other_cell + 0.15, blocked_y) == kUnknown);
    at(x, free_y) = kOccupied;
    at(x, blocked_y) = kFree;
    fuse(view_of(*other), *into);
    CHECK(at(x, free_y) == kOccupied);
    CHECK(at(x, blocked_y) == kOccupied);
  }
}

TEST_CASE("a map of points as a grid: free over floor, occupied up to the robot's height, unknown elsewhere") {
  TileMap map({});
  const std::vector<Point> points{{0.1f, 0.1f, 0}, {0.5f, 0.1f, 0},    {0.5f, 0.1f, 0.9f}, {0.9f, 0.1f, 2.2f},
                                  {1.3f, 0.1f, 0}, {1.3f, 0.1f, 2.2f}, {1.7f, 0.9f, 0.01f}};
  map.add({points, {}}, {}, 0);
  const GridMap grid = grid_of(map, {});
  CHECK(grid.width == 9);
  CHECK(grid.height == 5);
  CHECK(grid.corner.x_m == doctest::Approx(0));
  const auto at = [&](double x, double y) {
    return grid.view().at(static_cast<int>((x - grid.corner.x_m) / 0.2), static_cast<int>((y - grid.corner.y_m) / 0.2));
  };
  CHECK(at(0.1, 0.1) == kFree);
  CHECK(at(0.5, 0.1) == kOccupied);
  CHECK(at(0.9, 0.1) == kUnknown);  // nothing but what hangs above the robot
  CHECK(at(1.3, 0.1) == kFree);
  CHECK(at(0.1, 0.9) == kUnknown);
  CHECK(grid_of(TileMap({}), {}).cells.empty());
}

TEST_CASE("grids in files as map_server has them: what is written is read; other thresholds, modes, negated pictures") {
  const test::TemporaryFolder folder;
  GridMap map{3, 2, 0.25, {-1.5, 2, 0.5}, {0, 1000, -1, 100, 700, 500}};
  const std::filesystem::path yaml = folder.path / "map.yaml";
  REQUIRE(write_grid(yaml, map));
  const auto read = read_grid(yaml);
  REQUIRE(read);
  CHECK(read->width == 3);
  CHECK(read->height == 2);
  CHECK(read->cell_m == 0.25);
  CHECK(read->corner.y_m == 2);
  CHECK(read->corner.theta_rad == 0.5);
  CHECK(read->cells == std::vector<int16_t>{0, 1000, -1, 0, 1000, -1});  // 500 is neither
  const cv::Mat image = cv::imread((folder.path / "map.png").string(), cv::IMREAD_GRAYSCALE);
  CHECK(int{image.at<uint8_t>(1, 0)} == 254);  // the first row is the lowest
  CHECK(int{image.at<uint8_t>(1, 1)} == 0);
  CHECK(int{image.at<uint8_t>(1, 2)} == 205);

  const auto text = [&](const std::string& rest) {
    std::ofstream(yaml) << "image: map.png\nresolution: 0.1\norigin: [0, 0, 0]\n" << rest;
    return read_grid(yaml);
  };
  const auto negated = text("negate: 1\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
  REQUIRE(negated);
  CHECK(negated->cells[0] == kOccupied);
  const auto scaled = text("negate: 0\nmode: scale\noccupied_thresh: 0.65\nfree_thresh: 0.1\n");
  REQUIRE(scaled);
  CHECK(scaled->cells[2] == 175);  // (50/255 - 0.1) / 0.55
  CHECK(text("negate: 0\nfree_thresh: 0.1\n").error().find("occupied_thresh is missing") != std::string::npos);
  CHECK(text("negate: 0\nmode: raw\noccupied_thresh: 0.65\nfree_thresh: 0.1\n").error().find("trinary or scale") !=
        std::string::npos);
  CHECK(text("negate: 0\noccupied_thresh: 0.1\nfree_thresh: 0.2\n").error().find("below") != std::string::npos);
  std::ofstream(yaml) << "image: none.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.6\n"
                      << "free_thresh: 0.1\n";
  CHECK(read_grid(yaml).error().find("none.png") != std::string::npos);
  CHECK(read_grid(folder.path / "absent.yaml").error().find("absent.yaml") != std::string::npos);
  CHECK(write_grid(folder.path / "none" / "map.yaml", map).error().find("map.png") != std::string::npos);
}

TEST_CASE("a sliding grid keeps what stays within, wherever it goes") {
  SlidingGrid<int> grid(2, 0.1, -1);
  CHECK(grid.side() == 20);
  CHECK(grid.origin_x_m() == doctest::Approx(-1));
  grid.at(grid.column_of(0.55), grid.row_of(-0.35)) = 7;
  grid.centre(0.3, 0.21);
  CHECK(grid.at(grid.column_of(0.55), grid.row_of(-0.35)) == 7);
  CHECK(std::count(grid.cells().begin(), grid.cells().end(), -1) == 399);
  grid.centre(50, 0);
  CHECK_FALSE(grid.contains(grid.column_of(0.55), grid.row_of(-0.35)));
  CHECK(std::count(grid.cells().begin(), grid.cells().end(), -1) == 400);
  grid.lay_at(-1, -1);
  CHECK(grid.column_of(-0.95) == 0);
}
