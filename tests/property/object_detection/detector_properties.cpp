// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/reference.hpp"
#include "tests/property/object_detection/random_images.hpp"

using namespace takt;
using namespace takt::object_detection;
using takt::test::Random;

namespace {

constexpr int kWidth = 120, kHeight = 90, kView = 20, kWindow = 28;

/// Objects cut out of the image, so that some windows pass all stages, with some of the thresholds given.
std::vector<DatabaseObject> database(Random& random, const std::vector<uint8_t>& image) {
  std::vector<DatabaseObject> objects(static_cast<size_t>(random.in(1, 3)));
  for (DatabaseObject& object : objects) {
    for (auto& threshold : object.thresholds)
      if (random.in(0, 1) != 0) threshold = 0.1 * random.in(2, 9);
    for (int k = random.in(1, 3); k > 0; --k) {
      ReferenceView& view = object.views.emplace_back();
      view.side_px = kView;
      const int x = random.in(0, kWidth - kView), y = random.in(0, kHeight - kView);
      for (int row = y; row < y + kView; ++row) {
        const auto from = image.begin() + 3 * (row * kWidth + x);
        view.pixels.insert(view.pixels.end(), from, from + ptrdiff_t{3} * kView);
      }
      view.pixels[0] = 1;  // not background everywhere
      if (random.in(0, 2) == 0) view.thresholds[2] = 0.7;
    }
  }
  return objects;
}

/// Thesis Eq. 3.18 stage by stage, everything counted and compared anew: errors of one window for one object.
float error_by_brute_force(const Detector& detector, const DatabaseObject& object, size_t index,
                           const DetectorParameters& p, ImageView<const uint8_t> image, int window) {
  const SearchGrid& grid = detector.grid();
  const int x0 = grid.x0(window % grid.columns), y0 = grid.y0(window / grid.columns);
  float error = kFailed;
  for (size_t s = 0; s <= static_cast<size_t>(p.last); ++s) {
    std::vector<uint32_t> of_window;
    if (s == 0) of_window = colour_window_reference(image, x0, y0, kWindow, p.bins);
    if (s == 1) of_window = orientation_window_reference(image, x0, y0, kWindow, p.orientations);
    if (s == 2) of_window = cooccurrence_window_reference(image, x0, y0, kWindow, p.pairs);
    error = kFailed;
    for (size_t r = 0; r < object.views.size(); ++r) {
      const ReferenceLimit& limit = detector.limits(static_cast<Stage>(s))[index][r];
      const auto view = object.views[r].view();
      const Histogram reference = s == 0   ? colour_histogram(view, p.bins)
                                  : s == 1 ? orientation_histogram(view, OrientationBins(p.orientations))
                                           : cooccurrence_histogram(view, p.pairs);
      const uint32_t missing = missing_mass(of_window, reference.count);
      if (missing < limit.threshold * limit.mass || limit.mass == 0)
        error = std::min(error, static_cast<float>(missing) / static_cast<float>(std::max(1u, limit.mass)));
    }
    if (error == kFailed) break;
  }
  return error;
}

}  // namespace

TEST_CASE("the cascade equals doing each stage for each window that passed the one before") {
  Random random(61);
  size_t passed = 0, failed = 0;
  for (int round = 0; round < 12; ++round) {
    const std::vector<uint8_t> pixels = random.image(kWidth, kHeight);
    const ImageView<const uint8_t> image(pixels.data(), kWidth, kHeight, 3);
    const auto objects = database(random, pixels);
    DetectorParameters p;
    p.last = static_cast<Stage>(round % 3);
    p.window_px = kWindow;
    p.pairs = round % 2 ? PairBins{} : PairBins{5, 5};
    p.orientations = round % 2 ? 360 : 32;
    Detector detector(kWidth, kHeight, objects, p);
    REQUIRE(detector.run(image));
    CHECK(detector.searched() == 1);
    for (size_t o = 0; o < objects.size(); ++o) {
      for (int window = 0; window < detector.grid().windows(); ++window) {
        const float slow = error_by_brute_force(detector, objects[o], o, p, image, window);
        REQUIRE(detector.decision().errors(o)[static_cast<size_t>(window)] == slow);
        ++(slow < kFailed ? passed : failed);
      }
    }
  }
  CHECK(passed > 100);
  CHECK(failed > 100);
}

TEST_CASE(
    "out of time, the windows that were decided on are the best of the stage before, and searched counts the rest") {
  Random random(71);
  size_t cut_off = 0;
  for (int round = 0; round < 10; ++round) {
    const std::vector<uint8_t> pixels = random.image(kWidth, kHeight);
    const ImageView<const uint8_t> image(pixels.data(), kWidth, kHeight, 3);
    const auto objects = database(random, pixels);
    DetectorParameters p;
    p.window_px = kWindow;
    Detector whole(kWidth, kHeight, objects, p), cut(kWidth, kHeight, objects, p);
    p.last = Stage::orientation;
    Detector before(kWidth, kHeight, objects, p);
    whole.run(image);
    before.run(image);
    struct Candidate {
      float error;
      size_t window, object;
      bool operator<(const Candidate& other) const {
        return std::tie(error, window, object) < std::tie(other.error, other.window, other.object);
      }
    };
    std::vector<Candidate> candidates;
    for (size_t o = 0; o < objects.size(); ++o)
      for (size_t w = 0; w < before.decision().errors(o).size(); ++w)
        if (const float error = before.decision().errors(o)[w]; error < kFailed) candidates.push_back({error, w, o});
    std::sort(candidates.begin(), candidates.end());
    const auto decided = static_cast<size_t>(random.in(0, static_cast<int>(candidates.size())));
    REQUIRE(cut.run(
        image, [] { return true; }, [&, asked = size_t{0}]() mutable { return asked++ < decided; }));
    std::vector<bool> open(static_cast<size_t>(cut.grid().windows()));
    for (size_t i = 0; i < candidates.size(); ++i) {
      const auto& [error, window, object] = candidates[i];
      REQUIRE(cut.decision().errors(object)[window] ==
              (i < decided ? whole.decision().errors(object)[window] : kFailed));
      if (i >= decided) open[window] = true;
    }
    const auto left = std::count(open.begin(), open.end(), true);
    CHECK(cut.searched() == doctest::Approx(1.0 - static_cast<double>(left) / cut.grid().windows()));
    cut_off += candidates.size() - decided;
  }
  CHECK(cut_off > 50);
}
