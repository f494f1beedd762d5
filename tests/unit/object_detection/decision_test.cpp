// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/decision.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "rt/msg/ace/detections.hpp"

using namespace takt;
using namespace takt::object_detection;

namespace {

/// 6 x 4 windows of 8 px at stride 4; errors of references with 100 pixels, all at 100 until set.
struct Fixture {
  SearchGrid grid = make_search_grid(28, 20, 4, 8);
  std::vector<std::vector<ReferenceLimit>> objects;
  std::vector<uint16_t> missing;
  size_t references = 0;

  explicit Fixture(std::vector<std::vector<ReferenceLimit>> limits) : objects(std::move(limits)) {
    for (const auto& object : objects) references += object.size();
    missing.assign(static_cast<size_t>(grid.windows()) * references, 100);
  }
  void set(int u, int v, size_t reference, uint16_t value) {
    missing[static_cast<size_t>(v * grid.columns + u) * references + reference] = value;
  }
  Decision decide() const {
    const StageLimits limits(objects);
    Decision decision(grid, objects.size());
    for (size_t window = 0; window < static_cast<size_t>(grid.windows()); ++window) {
      const uint16_t* at = missing.data() + window * references;
      for (size_t object = 0; object < objects.size(); at += objects[object++].size())
        decision.set(object, window, limits.error(object, at));
    }
    return decision;
  }
  std::vector<Detection> detections(size_t most = 20, double min_score = 0) const {
    std::vector<Detection> out(most);
    out.resize(decide().detections(min_score, out));
    return out;
  }
  std::vector<uint8_t> roi() const {
    std::vector<uint8_t> pixels(static_cast<size_t>(grid.windows()), 7);
    decide().region_of_interest({pixels.data(), grid.columns, grid.rows});
    return pixels;
  }
};

}  // namespace

TEST_CASE("a window passes if one reference lies below its own threshold, and equality does not pass (E-17)") {
  Fixture f({{{100, 0.5}, {100, 0.2}}, {{100, 0.3}}});
  REQUIRE(f.grid.columns == 6);
  REQUIRE(f.grid.rows == 4);
  f.set(0, 0, 0, 49);  // passes
  f.set(1, 0, 0, 50);  // equal to the threshold
  f.set(2, 0, 1, 30);  // below the first reference's threshold but not below its own
  f.set(3, 0, 1, 19);  // passes
  f.set(5, 3, 2, 29);  // passes for the other object
  const auto roi = f.roi();
  CHECK(roi[0] == 255);
  CHECK(roi[1] == 0);
  CHECK(roi[2] == 0);
  CHECK(roi[3] == 255);
  CHECK(roi[23] == 255);
  CHECK(std::count(roi.begin(), roi.end(), 0) == 21);
  Decision decision = f.decide();
  CHECK(decision.passed_windows() == 3);
  CHECK(decision.errors(0)[0] == doctest::Approx(0.49));
  CHECK(decision.errors(0)[2] == kFailed);
  CHECK(decision.errors(1)[0] == kFailed);
}

TEST_CASE("touching windows of one object are one detection at the best of them; apart they are two") {
  Fixture f({{{100, 0.5}}, {{100, 0.5}}});
  f.set(0, 0, 0, 40);
  f.set(1, 1, 0, 10);  // touches by a corner
  f.set(2, 1, 0, 20);
  f.set(5, 1, 0, 30);  // apart
  f.set(1, 1, 1, 25);  // another object at the same place
  const auto found = f.detections();
  REQUIRE(found.size() == 3);
  CHECK(found[0].class_id == 0);
  CHECK(found[0].x_px == 4);
  CHECK(found[0].y_px == 4);
  CHECK(found[0].width_px == 8);
  CHECK(found[0].height_px == 8);
  CHECK(found[0].score == doctest::Approx(0.9));
  CHECK(found[1].class_id == 1);
  CHECK(found[1].score == doctest::Approx(0.75));
  CHECK(found[2].x_px == 20);
  CHECK(found[2].score == doctest::Approx(0.7));
}

TEST_CASE("of more detections than places the best stay") {
  Fixture f({{{100, 0.5}}});
  for (const int u : {0, 1, 2}) f.set(u, 0, 0, u == 0 ? 30 : 45);
  f.set(4, 0, 0, 20);
  f.set(0, 2, 0, 10);
  f.set(5, 3, 0, 40);
  CHECK(f.detections()[2].x_px == 0);
  const auto two = f.detections(2);
  REQUIRE(two.size() == 2);
  CHECK(two[0].score == doctest::Approx(0.9));
  CHECK(two[1].score == doctest::Approx(0.8));
  CHECK(f.detections(0).empty());
  CHECK(f.detections(20, 0.65).size() == 3);
  CHECK(f.detections(20, 0.95).empty());
}

TEST_CASE("a detection lies amid the windows around the best that are nearly as good, the better ones count more") {
  const auto x_px = [](std::vector<uint16_t> missing) {
    Fixture f({{{100, 0.5}}});
    for (size_t u = 0; u < missing.size(); ++u) f.set(static_cast<int>(u), 1, 0, missing[u]);
    const auto found = f.detections();
    REQUIRE(found.size() == 1);
    CHECK(found[0].y_px == 4);
    return found[0].x_px;
  };
  CHECK(x_px({40, 30, 40}) == 4);  // 0.1 worse: too far
  CHECK(x_px({45, 30, 35}) == doctest::Approx((4 * 0.1 + 8 * 0.05) / 0.15));
  CHECK(x_px({30, 30, 30, 30}) == 2);  // the upper left one is the best of equals
  CHECK(x_px({32, 31, 30}) == doctest::Approx((4 * 0.09 + 8 * 0.1) / 0.19));  // the first begins 8 px before the best
}

TEST_CASE("nothing below a threshold: no detection, an empty region of interest") {
  Fixture f({{{100, 0.5}}});
  CHECK(f.detections().empty());
  for (const uint8_t pixel : f.roi()) CHECK(pixel == 0);
}

TEST_CASE("a reference without mass has nothing that could be missing: every window passes") {
  const std::vector<std::vector<ReferenceLimit>> objects{{{0, 0.5}}};
  const uint32_t nothing = 0;
  CHECK(StageLimits(objects).error(0, &nothing) == 0);
}

TEST_CASE("cleared, no window passes") {
  Fixture f({{{100, 0.5}}});
  f.set(2, 1, 0, 10);
  Decision decision = f.decide();
  REQUIRE(decision.passed_windows() == 1);
  decision.clear();
  CHECK(decision.passed_windows() == 0);
}
