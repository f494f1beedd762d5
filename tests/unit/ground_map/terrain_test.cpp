// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/terrain.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "nodes/ground_map/terrain_drive.hpp"
#include "nodes/ground_map/terrain_file.hpp"
#include "rt/msg/ace/terrain.hpp"

using namespace takt;
using namespace takt::ground_map;

namespace {

const TerrainShape kSmall{4, 2, 2, 1, 0.5};

/// Of each kind: what is blocked beside the robot.
TerrainMaps small_maps() {
  TerrainMaps maps{kSmall, {}};
  maps.cells[terrain_kind::left] = {1000, 0, 0, 0, 1000, 0, 0, 0};
  maps.cells[terrain_kind::right] = {0, 0, 0, 1000, 0, 0, 0, 1000};
  maps.cells[terrain_kind::middle] = {1000, 0, 0, 1000, 1000, 0, 0, 1000};
  maps.cells[terrain_kind::crossing] = {0, 0, 0, 0, 0, 0, 0, 0};
  return maps;
}

}  // namespace

TEST_CASE("cells around the robot are those of the map at their centres, heading up") {
  Window window{-10, -10, 20, 0.5};
  std::vector<int16_t> map(400, kFree);
  const ImageView<int16_t> view(map.data(), 20, 20);
  const auto set = [&](double x_m, double y_m, int16_t value) {
    view.at(static_cast<int>(std::floor(x_m / 0.5)) + 10, static_cast<int>(std::floor(y_m / 0.5)) + 10) = value;
  };
  set(0.25, 0.75, 100);  // ahead of a robot at the origin and just right of its middle
  std::vector<int16_t> around(kSmall.cells());
  cells_around(view, window, {0, 0.5, 0}, kSmall, around);
  CHECK(around == std::vector<int16_t>{0, 0, 0, 0, 0, 0, 100, 0});
  // The robot looks along the map's -x axis: its right is the map's +y.
  cells_around(view, window, {0.5, 0.5, std::numbers::pi / 2}, kSmall, around);
  CHECK(around == std::vector<int16_t>{0, 0, 0, 0, 0, 0, 100, 0});
  cells_around(view, window, {4.75, 0, 0}, kSmall, around);  // the right half lies outside of the window
  CHECK(around[1] == kFree);
  CHECK(around[3] == kUnknown);
}

TEST_CASE("a learnt map is the mean of each cell over the maps that know it") {
  TerrainLearning learning(kSmall);
  learning.add(terrain_kind::left, std::vector<int16_t>{0, 1000, kUnknown, 0, 0, 0, 0, kUnknown});
  learning.add(terrain_kind::left, std::vector<int16_t>{1000, 1000, 300, 0, 0, 0, 1, kUnknown});
  CHECK(learning.maps(terrain_kind::left) == 2);
  const TerrainMaps maps = learning.learnt();
  CHECK(maps.cells[terrain_kind::left] == std::vector<int16_t>{500, 1000, 300, 0, 0, 0, 1, kUnknown});
  CHECK(maps.cells[terrain_kind::right] == std::vector<int16_t>(8, kUnknown));
}

TEST_CASE("correlation about the middle of the scale, and about the mean (Pearson)") {
  const std::vector<int16_t> a{1000, 0, 0, 0}, b{0, 0, 0, 1000}, flat(4, kFree), half{1000, 0, kUnknown, kUnknown};
  CHECK(*correlation(a, a, Centre::undecided, 0.3) == doctest::Approx(1));
  CHECK(*correlation(a, b, Centre::undecided, 0.3) == doctest::Approx(0));       // two cells agree, two do not
  CHECK(*correlation(a, flat, Centre::undecided, 0.3) == doctest::Approx(0.5));  // three against one
  CHECK(*correlation(a, b, Centre::mean, 0.3) == doctest::Approx(-1.0 / 3));
  CHECK(*correlation(a, a, Centre::mean, 0.3) == doctest::Approx(1));
  CHECK_FALSE(correlation(a, flat, Centre::mean, 0.3).has_value());  // no contrast
  // What no map of a kind has shown counts as undecided: a has four cells of contrast, half has two. What is not known
  // around the robot does not count.
  CHECK(*correlation(a, half, Centre::undecided, 0.5) == doctest::Approx(2 / std::sqrt(8.0)));
  CHECK(*correlation(half, a, Centre::undecided, 0.5) == doctest::Approx(1));
  CHECK(correlation(a, half, Centre::mean, 0.5).has_value());
  CHECK_FALSE(correlation(a, half, Centre::mean, 0.51).has_value());  // too little is known
  CHECK_FALSE(correlation(a, std::vector<int16_t>(4, kUnknown), Centre::undecided, 0).has_value());
}

TEST_CASE("counters: + 0.2 for the best kind, - 0.1 for the others, from unknown on") {
  TerrainClassifier classifier(small_maps(), {});
  CHECK(classifier.answer().kind == terrain_kind::unknown);
  CHECK(classifier.answer().hypotheses[terrain_kind::unknown] == 1);
  const std::vector<int16_t> left{900, 0, 0, 0, 900, 0, 0, 0}, nothing(8, kUnknown);
  for (int i = 1; i <= 3; ++i) {
    const Terrain& answer = classifier.step(left);
    CHECK(answer.hypotheses[terrain_kind::left] == doctest::Approx(0.2 * i));
    CHECK(answer.hypotheses[terrain_kind::unknown] == doctest::Approx(1 - 0.1 * i));
    CHECK(answer.kind == terrain_kind::unknown);
  }
  CHECK(classifier.answer().correlations[terrain_kind::left] > 0.95f);
  CHECK(classifier.answer().correlations[terrain_kind::left] > classifier.answer().correlations[terrain_kind::middle]);
  CHECK(classifier.step(left).kind == terrain_kind::left);  // 0.8 against 0.6
  for (int i = 0; i < 3; ++i) classifier.step(left);
  CHECK(classifier.answer().hypotheses[terrain_kind::left] == 1);
  // Maps that say nothing: unknown rises, and takes over once it is above the other.
  for (int i = 0; i < 2; ++i) CHECK(classifier.step(nothing).kind == terrain_kind::left);  // 0.8 and 0.7
  CHECK(classifier.answer().correlations[terrain_kind::left] == 0);
  CHECK(classifier.step(nothing).kind == terrain_kind::unknown);
}

TEST_CASE("each map is of its own kind, where free all over is a kind") {
  for (uint8_t kind = 0; kind < kTerrainKinds; ++kind) {
    TerrainClassifier classifier(small_maps(), {});
    for (int i = 0; i < 5; ++i) classifier.step(small_maps().cells[kind]);
    CHECK(classifier.answer().kind == kind);
  }
}

TEST_CASE("a crossing is believed where at most one known cell in 20 is blocked, the others from 0.7 on") {
  TerrainMaps maps{{40, 1, 20, 0, 0.3}, {}};
  for (auto& cells : maps.cells) cells.assign(40, kUnknown);
  maps.cells[terrain_kind::crossing].assign(40, kFree);
  maps.cells[terrain_kind::left].assign(40, kFree);
  std::fill_n(maps.cells[terrain_kind::left].begin(), 20, kOccupied);
  std::vector<int16_t> around(40, kFree);
  const auto believed = [&] {
    TerrainClassifier classifier(maps, {});
    classifier.step(around);
    return classifier.believed();
  };
  around[0] = kOccupied;
  CHECK(believed() == terrain_kind::crossing);
  around[1] = kOccupied;
  CHECK(believed() == terrain_kind::unknown);
  std::fill_n(around.begin(), 16, kOccupied);  // 0.8 of half and half
  CHECK(believed() == terrain_kind::left);
  std::fill_n(around.begin(), 13, kFree);  // 0.15 of it
  CHECK(believed() == terrain_kind::unknown);
}

TEST_CASE("a file of maps is read back as it was written, several maps of a kind as their mean") {
  std::stringstream text;
  write_terrain_shape(text, kSmall);
  const TerrainMaps maps = small_maps();
  for (size_t kind = 0; kind < kTerrainKinds; ++kind) write_terrain_map(text, kSmall, kind, maps.cells[kind]);
  write_terrain_map(text, kSmall, terrain_kind::crossing, std::vector<int16_t>{500, 0, 0, kUnknown, 0, 0, 0, 0});
  const TerrainLearning learning = parse_terrain(text, "maps");
  CHECK(learning.maps(terrain_kind::crossing) == 2);
  const TerrainMaps back = learning.learnt();
  CHECK(back.shape == kSmall);
  CHECK(back.cells[terrain_kind::middle] == maps.cells[terrain_kind::middle]);
  CHECK(back.cells[terrain_kind::crossing] == std::vector<int16_t>{250, 0, 0, 0, 0, 0, 0, 0});
}

TEST_CASE("what is wrong with a file of maps is told with its line") {
  const auto refuses = [](const std::string& text, const char* said) {
    std::istringstream in(text);
    CHECK_THROWS_WITH_AS(parse_terrain(in, "maps"), doctest::Contains(said), TerrainError);
  };
  refuses("", "maps:0: has no maps");
  refuses("# nothing\nmap left\n", "maps:2: must begin with `cells");
  refuses("cells 2 1 1 0 0.3\nmap up\n", "maps:2: here must stand `map` with left, right, middle or crossing");
  refuses("cells 2 1 1 0 9\n", "`9` is no number in 0.05..1");
  refuses("cells 2 1 1 0 0.3\nmap left\n0 0 0\n", "maps:3: the row has 3 cells, must have 2");
  refuses("cells 2 1 1 0 0.3\nmap left\n0 1001\n", "`1001` is no number in -1..1000");
  refuses("cells 2 2 1 0 0.3\nmap left\n0 0\n", "the last map lacks 1 rows");
  refuses("cells 2 1 1 0 0.3\nmap left\n0 0\n", "has no `map right`");
  refuses("cell 2\n", "maps:1: must begin with `cells");
}

TEST_CASE("a generated drive shows each kind, and a part of the images two at once") {
  TerrainDriveOptions options;
  options.passes = 1;
  options.frame_step_m = 1;
  std::array<int, kHypotheses> seen{};
  int two = 0, known = 0;
  TerrainDrive(options).run({}, [&](std::span<const int16_t> around, std::optional<size_t> truth) {
    if (truth) ++seen[*truth];
    else ++two;
    known += std::any_of(around.begin(), around.end(), [](int16_t cell) { return cell != kUnknown; });
  });
  for (const int count : seen) CHECK(count > 2);
  CHECK(two > 10);
  CHECK(known > 45);
}
