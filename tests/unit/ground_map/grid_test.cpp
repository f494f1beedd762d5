// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "nodes/ground_map/evaluate.hpp"
#include "nodes/ground_map/ground_detector.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "nodes/ground_map/pavement_scene.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "tests/unit/ground_map/camera.hpp"

using namespace takt;
using namespace takt::ground_map;
using test::kCamera, test::kHeight, test::kWidth;

namespace {

struct View {
  FloorProjection projection = floor_projection(kCamera, mapping_3d::camera_mount(0, 0, 1.2, 0, -0.45));
  std::vector<uint8_t> mask = std::vector<uint8_t>(kWidth * kHeight, 255);
  ImageView<uint8_t> view() { return {mask.data(), kWidth, kHeight}; }
  /// Everything that the floor shows beyond that distance ahead is not ground.
  void wall(double y_m) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto p = projection.floor_at(x, y);
        view().at(x, y) = p && p->y_m < y_m ? 255 : 0;
      }
  }
};

int16_t cell_at(const GroundGrid& grid, ImageView<const int16_t> cells, double x_m, double y_m) {
  const FloorPoint origin = grid.window().origin();
  return cells.at(static_cast<int>((x_m - origin.x_m) / grid.window().cell_m),
                  static_cast<int>((y_m - origin.y_m) / grid.window().cell_m));
}

}  // namespace

TEST_CASE("one image: free up to the first pixel that is no ground, occupied there, unknown beyond (A-12)") {
  View view;
  view.wall(3.1);  // in the row of cells 3.0 .. 3.3
  GroundGrid grid(kWidth, {});
  grid.observe(view.view(), view.projection, {0, 0});
  CHECK(cell_at(grid, grid.observation(), 0.1, 2.5) == kFree);
  CHECK(cell_at(grid, grid.observation(), 0.1, 2.8) == kFree);
  CHECK(cell_at(grid, grid.observation(), 0.1, 3.1) == kOccupied);
  CHECK(cell_at(grid, grid.observation(), 0.1, 3.5) == kUnknown);
  CHECK(cell_at(grid, grid.observation(), 0.1, -1.0) == kUnknown);
  CHECK(cell_at(grid, grid.map(), 0.1, 3.1) == kUnknown);  // not accumulated yet

  // Counting pixels, the ground before the wall outvotes the one pixel per column that is none.
  GridParameters by_pixels;
  by_pixels.votes = Votes::pixels;
  GroundGrid pixels(kWidth, by_pixels);
  view.wall(3.29);
  pixels.observe(view.view(), view.projection, {0, 0});
  CHECK(cell_at(pixels, pixels.observation(), 0.1, 3.1) == kFree);
  view.wall(3.0);
  pixels.observe(view.view(), view.projection, {0, 0});
  CHECK(cell_at(pixels, pixels.observation(), 0.1, 3.1) == kOccupied);
}

TEST_CASE("beyond range_max nothing is seen") {
  View view;
  GridParameters p;
  p.range_max_m = 2.4;
  GroundGrid grid(kWidth, p);
  grid.observe(view.view(), view.projection, {0, 0});
  CHECK(cell_at(grid, grid.observation(), 0.1, 2.0) == kFree);
  CHECK(cell_at(grid, grid.observation(), 0.1, 2.8) == kUnknown);
  view.wall(3.0);  // an obstacle there is not seen either
  grid.observe(view.view(), view.projection, {0, 0});
  CHECK(cell_at(grid, grid.observation(), 0.1, 3.1) == kUnknown);
}

TEST_CASE("cells start at 0.5, rise by 0.2 where blocked, fall by 0.1 where free, within 0..1") {
  View view;
  view.wall(3.1);
  GroundGrid grid(kWidth, {});
  grid.observe(view.view(), view.projection, {0, 0});
  const int occupied[] = {700, 900, 1000, 1000}, free[] = {400, 300, 200, 100};
  for (int i = 0; i < 4; ++i) {
    grid.accumulate();
    CHECK(cell_at(grid, grid.map(), 0.1, 3.1) == occupied[i]);
    CHECK(cell_at(grid, grid.map(), 0.1, 2.5) == free[i]);
    CHECK(cell_at(grid, grid.map(), 0.1, 5.0) == kUnknown);
  }
}

TEST_CASE("the window follows the robot by whole cells; a cell stays where it is in the map") {
  View view;
  view.wall(3.1);
  GroundGrid grid(kWidth, {});
  grid.observe(view.view(), view.projection, {0, 0});
  grid.accumulate();
  for (const FloorPoint robot : {FloorPoint{0.1, 0.2}, FloorPoint{0.4, 2.0}, FloorPoint{-2.0, 1.0}}) {
    grid.centre(robot);
    const FloorPoint origin = grid.window().origin();
    const double half = grid.window().cells / 2 * 0.3;
    CHECK(origin.x_m + half <= robot.x_m);
    CHECK(origin.x_m + half > robot.x_m - 0.3);
    CHECK(cell_at(grid, grid.map(), 0.1, 3.1) == 700);
    CHECK(cell_at(grid, grid.map(), 0.1, 2.5) == 400);
    CHECK(cell_at(grid, grid.map(), -2.0, -1.0) == kUnknown);
  }
  grid.centre({100, 100});
  grid.centre({0, 0});
  CHECK(cell_at(grid, grid.map(), 0.1, 3.1) == kUnknown);  // left behind, forgotten
}

TEST_CASE("scores count pixels and borders") {
  const std::vector<uint8_t> mask{255, 255, 0, 0, 255, 0}, truth{1, 0, 1, 0, 2, 2};
  MaskScore score;
  CHECK(score.precision_pct() == 0);
  add(score, {mask.data(), 3, 2}, {truth.data(), 3, 2});
  CHECK(score.right == 1);
  CHECK(score.wrong == 1);
  CHECK(score.missed == 1);
  CHECK(score.precision_pct() == doctest::Approx(50));
  CHECK(score.recall_pct() == doctest::Approx(50));

  View view;
  view.wall(3.0);
  const auto borders = free_range(view.view(), 255, view.projection, {0, 0}, 8);
  CHECK(borders[160] == doctest::Approx(3.0).epsilon(0.02));  // a row is 5 cm there
  std::vector<double> errors;
  add_border_errors({8, 3, 8}, {8, 3.5, 7}, 8, errors);
  CHECK(errors == std::vector<double>{0.5, 1});

  std::vector<uint8_t> bottom(10);
  bottom_is_ground({bottom.data(), 1, 10});
  CHECK(bottom == std::vector<uint8_t>{0, 0, 0, 0, 0, 0, 255, 255, 255, 255});
}

TEST_CASE("generated pavement: equal for equal seeds, and found better than by the trivial method") {
  PavementOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.frames = 20;
  const PavementScene scene(options), again(options);
  std::vector<uint8_t> bgr(kWidth * kHeight * 3), truth(kWidth * kHeight), mask(truth.size()), second(bgr.size());
  const ImageView<uint8_t> image(bgr.data(), kWidth, kHeight, 3), t(truth.data(), kWidth, kHeight),
      m(mask.data(), kWidth, kHeight);
  again.render(7, {second.data(), kWidth, kHeight, 3}, t);
  scene.render(7, image, t);
  CHECK(bgr == second);

  // Truth and projection agree: a ground pixel sees a drivable point of the floor.
  const FloorProjection in_map = floor_projection(scene.camera(), scene.camera_in_robot()).moved(scene.robot_in_map(7));
  int ground = 0, agree = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (t.at(x, y) == static_cast<uint8_t>(Truth::ground)) {
        const auto p = in_map.floor_at(x, y);
        ++ground;
        agree += p && scene.drivable(*p);
      }
  CHECK(ground > 5000);
  CHECK(agree == ground);

  GroundDetector detector(kWidth, kHeight, {});
  const FloorProjection in_robot = floor_projection(scene.camera(), scene.camera_in_robot());
  MaskScore ours, trivial;
  std::vector<double> our_errors, trivial_errors;
  for (int frame = 0; frame < options.frames; ++frame) {
    scene.render(frame, image, t);
    detector.analyse(image);
    detector.learn();
    detector.classify(m);
    const auto border = free_range(t, static_cast<uint8_t>(Truth::ground), in_robot, {0, 0}, 8);
    add(ours, m, t);
    add_border_errors(free_range(m, 255, in_robot, {0, 0}, 8), border, 8, our_errors);
    bottom_is_ground(m);
    add(trivial, m, t);
    add_border_errors(free_range(m, 255, in_robot, {0, 0}, 8), border, 8, trivial_errors);
  }
  CHECK(ours.precision_pct() > 95);
  CHECK(ours.precision_pct() > trivial.precision_pct() + 5);
  CHECK(ours.recall_pct() > 85);
  const auto median = [](std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + static_cast<ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  CHECK(median(our_errors) < 0.2);
  CHECK(median(trivial_errors) > 0.5);
}
