// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "nodes/object_3d/scenes.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::object_3d;

namespace {

const auto kWhole = [] { return true; };

/// A flat picture of a wall 1 m away: each pixel of `picture` a point.
struct Wall {
  std::vector<Point> points;
  std::vector<Colour> colours;
  CameraModel camera{100, 0, 0, 0.1};
  explicit Wall(const cv::Mat3b& picture) {
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        points.push_back({0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 1});
        colours.push_back({picture(y, x)[0], picture(y, x)[1], picture(y, x)[2]});
      }
  }
};

}  // namespace

TEST_CASE("support: a slightly tilted table is found through noise and things on it; a ramp or a few points are none") {
  cv::RNG random(1);
  std::vector<Point> points;
  for (int i = 0; i < 4000; ++i) {
    const double x = random.uniform(-0.5, 0.5), y = random.uniform(0.5, 1.5);
    points.push_back({static_cast<float>(x), static_cast<float>(y),
                      static_cast<float>(0.7 + 0.02 * x - 0.01 * y + random.gaussian(0.003))});
    if (i % 5 == 0) points.push_back({0.1f, 0.8f, static_cast<float>(random.uniform(0.75, 1.1))});
  }
  const auto plane = find_support(points, {});
  REQUIRE(plane);
  CHECK(plane->a == doctest::Approx(0.02).epsilon(0.1));
  CHECK(plane->b == doctest::Approx(-0.01).epsilon(0.1));
  CHECK(plane->z(0, 1) == doctest::Approx(0.69).epsilon(0.001));
  CHECK_FALSE(find_support(points, {.slope_max = 0.01}));
  CHECK_FALSE(find_support(points, {.fewest = 5000}));
  CHECK_FALSE(find_support(points, {.low_m = 2, .high_m = 3}));
  CHECK_FALSE(find_support({}, {}));
}

TEST_CASE("pixel grid: points come back at the pixels they were triangulated from; what cannot be is refused") {
  const Wall wall(cv::Mat3b(30, 40, cv::Vec3b(0, 0, 0)));
  PixelGrid grid(40 * 30);
  REQUIRE(grid.fill(wall.points, wall.camera, 1));
  CHECK(grid.columns() == 40);
  CHECK(grid.rows() == 30);
  for (uint32_t i = 0; i < wall.points.size(); ++i) {
    REQUIRE(grid.at(grid.column_of(i), grid.row_of(i)) == static_cast<int32_t>(i));
    REQUIRE(grid.column_of(i) == static_cast<int>(i % 40));
  }
  CHECK_FALSE(grid.fill(wall.points, {}, 1));
  CHECK_FALSE(grid.fill(wall.points, wall.camera, 0));
  CHECK(grid.empty());
  PixelGrid small(40 * 29);
  CHECK_FALSE(small.fill(std::span(wall.points).first(100), {1e9, 0, 0, 0.1}, 1));  // far too wide
  const std::vector<Point> behind{{0, 0, -1}};
  CHECK_FALSE(grid.fill(behind, wall.camera, 1));
}

TEST_CASE("smoothing takes the noise out of a slanted plane up to its rim, and drops what lies on no surface") {
  cv::RNG random(2);
  std::vector<Point> points;
  std::vector<double> truth;
  const CameraModel camera{500, 0, 0, 0.24};
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) {
      const double w = 0.8 + 0.004 * x - 0.002 * y, noisy = w + random.gaussian(0.002);
      truth.push_back(1 / w);
      points.push_back({static_cast<float>(x / 500.0 / noisy), static_cast<float>(y / 500.0 / noisy),
                        static_cast<float>(1 / noisy)});
    }
  points[820] = {points[820].x * 1.5f, points[820].y * 1.5f, points[820].z * 1.5f};  // flies
  PixelGrid grid(1600);
  REQUIRE(grid.fill(points, camera, 1));
  std::vector<uint32_t> members(1600);
  for (uint32_t i = 0; i < 1600; ++i) members[i] = i;
  SurfaceSmoother smoother(1600);
  const auto smooth = smoother.run(grid, points, members, 0.06f);
  REQUIRE(smooth.size() == 1599);
  double before = 0, after = 0, rim = 0;
  size_t rims = 0;
  for (size_t i = 0; i < smooth.size(); ++i) {
    const uint32_t k = members[i];
    CHECK(k != 820);
    const double off = static_cast<double>(smooth[i].z) - truth[k];
    before += std::pow(static_cast<double>(points[k].z) - truth[k], 2), after += off * off;
    if (k % 40 == 0) rim += off, ++rims;
    REQUIRE(smooth[i].x / smooth[i].z == doctest::Approx(points[k].x / points[k].z));  // on its ray
  }
  CHECK(after < 0.1 * before);
  CHECK(std::abs(rim / static_cast<double>(rims)) < 0.0005);  // not bent, 0.0064 m per pixel of slope notwithstanding
}

TEST_CASE("colour: skin as the reference has it, hue through 360 degrees and without") {
  const ColourModel skin;
  CHECK(skin.holds({110, 140, 200}));        // hue 20, saturation 0.45
  CHECK(skin.holds({120, 110, 200}));        // hue 353
  CHECK_FALSE(skin.holds({110, 200, 140}));  // green
  CHECK_FALSE(skin.holds({190, 195, 200}));  // too pale
  CHECK_FALSE(skin.holds({10, 20, 40}));     // too dark
  const ColourModel blue{200, 260, 0.3, 1, 0.2, 1};
  CHECK(blue.holds({200, 60, 40}));
  CHECK_FALSE(blue.holds({40, 60, 200}));
  CHECK(hsv_of({0, 128, 255}).hue_deg == doctest::Approx(30.1).epsilon(0.01));
  CHECK(hsv_of({128, 128, 128}).saturation == 0);
}

TEST_CASE(
    "colour seeds: opened and closed as OpenCV does it, one seed in the middle of each component of fitting size") {
  cv::Mat3b picture(60, 80, cv::Vec3b(90, 90, 90));
  const cv::Scalar skin(110, 140, 200);
  cv::rectangle(picture, {5, 5, 21, 15}, skin, cv::FILLED);
  cv::rectangle(picture, {40, 20, 31, 31}, skin, cv::FILLED);
  cv::rectangle(picture, {52, 33, 2, 3}, cv::Scalar(90, 90, 90), cv::FILLED);  // a hole that closing fills
  cv::rectangle(picture, {10, 40, 8, 8}, skin, cv::FILLED);                    // too small
  cv::line(picture, {0, 55}, {70, 55}, skin);                                  // opening takes it away
  cv::RNG random(3);
  for (int i = 0; i < 200; ++i) picture(random.uniform(0, 60), random.uniform(0, 80)) = cv::Vec3b(110, 140, 200);
  const Wall wall(picture);
  PixelGrid grid(4800);
  REQUIRE(grid.fill(wall.points, wall.camera, 1));
  ColourSeeds finder(4800);
  uint32_t seeds[8];
  REQUIRE(finder.find(grid, wall.colours, {}, {100, 20'000}, 1, seeds) == 2);
  const auto near = [](uint32_t seed, int x, int y) {
    CHECK(std::abs(static_cast<int>(seed % 80) - x) <= 2);
    CHECK(std::abs(static_cast<int>(seed / 80) - y) <= 2);
  };
  near(seeds[0], 15, 12);
  near(seeds[1], 55, 35);
  CHECK(finder.find(grid, wall.colours, {}, {100, 500}, 1, seeds) == 1);
  CHECK(finder.find(grid, wall.colours, {}, {100, 20'000}, 1, std::span(seeds).first(1)) == 1);

  cv::Mat1b wanted(60, 80, uint8_t{0});
  for (int i = 0; i < 4800; ++i) wanted(i / 80, i % 80) = ColourModel{}.holds(wall.colours[static_cast<size_t>(i)]);
  cv::morphologyEx(wanted, wanted, cv::MORPH_OPEN, cv::Mat1b(3, 3, uint8_t{1}));
  cv::morphologyEx(wanted, wanted, cv::MORPH_CLOSE, cv::Mat1b(5, 5, uint8_t{1}));
  CHECK(std::equal(wanted.begin(), wanted.end(), finder.mask().begin()));
}

TEST_CASE("three things on a table: three objects beside one another, from everything, from boxes, from a colour") {
  const Scene scene = make_scene(table_models(), {0, 2, 4}, {}, 9, 0);
  FinderParameters p;
  p.beside_m = 0.4;
  ObjectFinder standing(scene.points.size(), 8, p, nullptr);
  const auto found = standing.run(scene.cloud(), {}, kWhole);
  REQUIRE(found.size() == 3);
  CHECK(standing.searched() == 1);
  for (const FoundObject& object : found) {
    CHECK(object.on == kOnSupport);
    CHECK(object.beside != kBesideNothing);
    CHECK(object.answer.class_id == kUnknown);  // nobody classifies
    size_t own = 0;
    const auto points = standing.points_of(object);
    for (const uint32_t i : points) own += scene.object[i] == scene.object[points[0]];
    CHECK(own > 0.98 * static_cast<double>(points.size()));
  }
  p.seeds = SeedSource::boxes;
  ObjectFinder boxed(scene.points.size(), 8, p, nullptr);
  // Around the pixels of the middle one, as a detector would.
  float left = 1e9f, right = 0, top = 1e9f, bottom = 0;
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (scene.object[i] != 1) continue;
    const Point& q = scene.points[i];
    const auto f = static_cast<float>(scene.camera.focal_px);
    const float u = f * q.x / q.z + static_cast<float>(scene.camera.cu_px),
                v = f * q.y / q.z + static_cast<float>(scene.camera.cv_px);
    left = std::min(left, u), right = std::max(right, u), top = std::min(top, v), bottom = std::max(bottom, v);
  }
  const std::vector<Detection> boxes{{0, left - 10, top - 10, right - left + 20, bottom - top + 20, 1},
                                     {0, 0, 0, 4, 4, 1}};
  const auto one = boxed.run(scene.cloud(), boxes, kWhole);
  REQUIRE(one.size() == 1);
  CHECK(scene.object[boxed.points_of(one[0])[0]] == 1);

  p.seeds = SeedSource::colour;
  p.colour = {345, 15, 0.4, 1, 0.2, 1};  // the can is red
  ObjectFinder coloured(scene.points.size(), 8, p, nullptr);
  const auto red = coloured.run(scene.cloud(), {}, kWhole);
  REQUIRE(red.size() == 1);
  CHECK(scene.object[coloured.points_of(red[0])[0]] == 1);
}

TEST_CASE("what lies on another thing stands on it, where colours part the two") {
  cv::RNG random(4);
  const Model below{"box", {{Solid::box, 0, 0, 0, 0.30, 0.25, 0.10}}, {180, 60, 40}};
  Model above{"box", {{Solid::box, 0, 0, 0.10, 0.12, 0.10, 0.08}}, {40, 60, 190}};
  const Scene scene = make_scene_of({{0, below, 0, 1.1, 0.3}, {1, above, 0, 1.1, 0.5}}, {}, random);
  FinderParameters p;
  ObjectFinder blind(scene.points.size(), 8, p, nullptr);
  CHECK(blind.run(scene.cloud(), {}, kWhole).size() == 1);  // they touch
  p.segment.grow.colour_max = 0.15f;
  ObjectFinder finder(scene.points.size(), 8, p, nullptr);
  const auto found = finder.run(scene.cloud(), {}, kWhole);
  REQUIRE(found.size() == 2);
  CHECK(found[0].on == 1);
  CHECK(found[1].on == kOnSupport);
  CHECK(value(found[0].what.attributes, Attribute::height) == doctest::Approx(0.08).epsilon(0.1));
}

TEST_CASE("without a table nothing stands on one; points that are none are passed over") {
  std::vector<Point> points{{0, 0, std::numeric_limits<float>::quiet_NaN()}, {0, 0, 1}, {1e30f, 0, 1}};
  ObjectFinder finder(10, 4, {}, nullptr);
  const SensorCloud cloud{points, {}, {}, 0, {}};
  CHECK(finder.run(cloud, {}, kWhole).empty());
  CHECK_FALSE(finder.support());
  CHECK(finder.searched() == 1);
  CHECK(finder.run({}, {}, kWhole).empty());
}

TEST_CASE("the work stops when it is told to, with whole objects, and says how far it came") {
  const Scene scene = make_scene(table_models(), {0, 1, 4}, {}, 11, 0);
  ObjectFinder finder(scene.points.size(), 8, {}, nullptr);
  const size_t all = finder.run(scene.cloud(), {}, kWhole).size();
  REQUIRE(all == 3);
  size_t before = 0;
  bool some = false;
  for (int portions = 0; portions < 200; ++portions) {
    const auto found = finder.run(scene.cloud(), {}, [&, left = portions]() mutable { return left-- > 0; });
    CHECK(found.size() <= all);
    some |= found.size() > 0 && found.size() < all;
    before = std::max(before, found.size());
    if (finder.searched() == 1) {
      CHECK(found.size() == all);
      break;
    }
  }
  CHECK(before == all);
  CHECK(finder.searched() == 1);
}

TEST_CASE("finding objects allocates nothing, with any seeds and any classifier") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  const Scene scene = make_scene(table_models(), {0, 3, 5}, {}, 2, 0);
  Training training{{Attribute::length, Attribute::height, Attribute::red}, {"a", "b", "c"}, {}};
  for (size_t i = 0; i < 9; ++i) {
    training.samples.push_back({i / 3, {}});
    training.samples.back().attributes.fill(static_cast<float>(i * i % 7));
  }
  NearestNeighbour nearest(training, {});
  SupportVectorMachines rest(training, {SvmScheme::one_vs_rest}), pairs(training, {SvmScheme::pairwise});
  const std::vector<Detection> boxes{{0, 280, 200, 80, 80, 1}};
  for (Classifier* classifier :
       {static_cast<Classifier*>(&nearest), static_cast<Classifier*>(&rest), static_cast<Classifier*>(&pairs)})
    for (const SeedSource seeds : {SeedSource::standing, SeedSource::colour, SeedSource::boxes}) {
      FinderParameters p;
      p.seeds = seeds;
      ObjectFinder finder(scene.points.size(), 8, p, classifier);
      const uint64_t before = thread_memory_use().allocations;
      finder.run(scene.cloud(), boxes, kWhole);
      CHECK(thread_memory_use().allocations == before);
    }
}
