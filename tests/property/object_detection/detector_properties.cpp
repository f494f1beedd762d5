// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>
#include <tuple>
#include <vector>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/reference.hpp"
#include "tests/property/object_detection/random_images.hpp"
#include "tests/property_scale.hpp"

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

/// Thesis Eq. 3.18 stage by stage, everything counted and compared anew: errors of one window of the image at that
/// scale for one object.
float error_by_brute_force(const Detector& detector, size_t scale, const DatabaseObject& object, size_t index,
                           const DetectorParameters& p, ImageView<const uint8_t> image, int window) {
  const SearchGrid& grid = detector.at_scale(scale).grid();
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
      const ReferenceView small = shrunk(object.views[r], p.smallest);
      const auto view = small.view();
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

TEST_CASE("a smaller scale equals doing each pixel by itself, and OpenCV") {
  Random random(test::seed(19));
  for (int round = 0; round < test::rounds(30); ++round) {
    const int width = random.in(2, 90), height = random.in(2, 70);
    const double scale = round == 0 ? 0.5 : 0.01 * random.in(50, 99);
    CAPTURE(width);
    CAPTURE(height);
    CAPTURE(scale);
    std::vector<uint8_t> pixels(static_cast<size_t>(3 * width * height));
    for (uint8_t& value : pixels) value = random.byte();
    const ImageView<const uint8_t> image(pixels.data(), width, height, 3);
    Shrinker shrinker(width, height, scale);
    const auto small = shrinker.run(image);
    const auto slow = shrink_reference(image, small.width, small.height);
    REQUIRE(std::equal(slow.begin(), slow.end(), small.data));
    cv::Mat theirs;
    cv::resize(cv::Mat(height, width, CV_8UC3, pixels.data()), theirs, {small.width, small.height}, 0, 0,
               cv::INTER_LINEAR_EXACT);
    REQUIRE(std::equal(slow.begin(), slow.end(), theirs.datastart));
  }
}

TEST_CASE("a smaller view: pixels between those of the object, as OpenCV has them; background where little is object") {
  Random random(test::seed(23));
  for (const double scale : {0.5, 0.7, 0.83, 1.0}) {
    constexpr int kSide = 40;
    std::vector<uint8_t> pixels(3 * kSide * kSide, 0), object(pixels.size(), 0);
    for (int y = 3; y < 31; ++y) {
      for (int x = 9; x < 36; ++x) {
        const auto i = static_cast<size_t>(3 * (y * kSide + x));
        for (size_t c = 0; c < 3; ++c)
          pixels[i + c] = random.in(0, 3) ? random.byte() : uint8_t{0}, object[i + c] = 255;
        if ((pixels[i] | pixels[i + 1] | pixels[i + 2]) == 0) std::fill_n(&pixels[i], 3, uint8_t{1});
      }
    }
    const int side = static_cast<int>(std::lround(scale * kSide));
    cv::Mat theirs, share;
    cv::resize(cv::Mat(kSide, kSide, CV_8UC3, pixels.data()), theirs, {side, side}, 0, 0, cv::INTER_LINEAR_EXACT);
    cv::resize(cv::Mat(kSide, kSide, CV_8UC3, object.data()), share, {side, side}, 0, 0, cv::INTER_LINEAR_EXACT);
    const ReferenceView small = shrunk({"", kSide, pixels, {}}, scale);
    CHECK(small.side_px == side);
    const std::vector<uint8_t>& ours = small.pixels;
    REQUIRE(ours.size() == static_cast<size_t>(3 * side * side));
    size_t objects = 0;
    for (size_t i = 0; i < ours.size(); i += 3) {
      const bool is_object = share.data[i] >= 204;
      const bool black = (theirs.data[i] | theirs.data[i + 1] | theirs.data[i + 2]) == 0;
      for (size_t c = 0; c < 3; ++c) REQUIRE(ours[i + c] == (!is_object ? 0 : black ? 1 : theirs.data[i + c]));
      objects += is_object;
    }
    CHECK(static_cast<double>(objects) > (scale * 28 - 1.5) * (scale * 27 - 1.5));
    CHECK(static_cast<double>(objects) < (scale * 28 + 1) * (scale * 27 + 1));
    if (scale == 1) CHECK(ours == pixels);
  }
}

TEST_CASE("the cascade equals doing each stage for each window that passed the one before, at each scale") {
  Random random(test::seed(61));
  size_t passed = 0, failed = 0;
  // At any scale: windows pass and fail by whole rounds, and three of these may have none that fails.
  const int rounds = std::max(test::rounds(12), 12);
  for (int round = 0; round < rounds; ++round) {
    const std::vector<uint8_t> pixels = random.image(kWidth, kHeight);
    const ImageView<const uint8_t> image(pixels.data(), kWidth, kHeight, 3);
    const auto objects = database(random, pixels);
    DetectorParameters p;
    p.last = static_cast<Stage>(round % 3);
    p.window_px = kWindow;
    p.pairs = round % 2 ? PairBins{} : PairBins{5, 5};
    p.orientations = round % 2 ? 360 : 32;
    if (round >= 6) p.scales = {1, 0.7, 0.5};
    if (round % 2) p.smallest = 1;
    Detector detector(kWidth, kHeight, objects, p);
    REQUIRE(detector.run(image));
    CHECK(detector.searched() == 1);
    REQUIRE(detector.scales() == p.scales.size());
    for (size_t s = 0; s < detector.scales(); ++s) {
      const SearchGrid& grid = detector.at_scale(s).grid();
      const auto small = shrink_reference(image, grid.image_width, grid.image_height);
      const ImageView<const uint8_t> scaled(small.data(), grid.image_width, grid.image_height, 3);
      CHECK(grid.image_width == std::lround(p.scales[s] * kWidth));
      for (size_t o = 0; o < objects.size(); ++o) {
        for (int window = 0; window < grid.windows(); ++window) {
          const float slow = error_by_brute_force(detector, s, objects[o], o, p, scaled, window);
          REQUIRE(detector.at_scale(s).decision().errors(o)[static_cast<size_t>(window)] == slow);
          ++(slow < kFailed ? passed : failed);
        }
      }
    }
  }
  CHECK(passed >= 100);
  CHECK(failed >= 100);
}

TEST_CASE("with a mask the windows that it touches are as without, the others do not pass") {
  Random random(test::seed(83));
  size_t within = 0, outside = 0;
  for (int round = 0; round < test::rounds(12); ++round) {
    const std::vector<uint8_t> pixels = random.image(kWidth, kHeight);
    const ImageView<const uint8_t> image(pixels.data(), kWidth, kHeight, 3);
    const auto objects = database(random, pixels);
    DetectorParameters p;
    p.window_px = kWindow;
    p.last = static_cast<Stage>(round % 3);
    p.scales = {1, 0.7};
    const int width = random.in(1, kWidth), height = random.in(1, kHeight);
    std::vector<uint8_t> mask(static_cast<size_t>(width * height));
    for (int blot = random.in(0, 3); blot > 0; --blot)
      mask[static_cast<size_t>(random.in(0, width * height - 1))] = 255;
    MaskSums sums(mask.size());
    sums.take({mask.data(), width, height});
    Detector whole(kWidth, kHeight, objects, p), masked(kWidth, kHeight, objects, p);
    whole.run(image);
    REQUIRE(masked.run(
        image, &sums, [] { return true; }, [] { return true; }));
    CHECK(masked.searched() == 1);
    for (size_t s = 0; s < masked.scales(); ++s) {
      const SearchGrid& grid = masked.at_scale(s).grid();
      for (int window = 0; window < grid.windows(); ++window) {
        // Of each pixel of the mask the rectangle that it covers in the image of this scale.
        const double x0 = grid.x0(window % grid.columns), y0 = grid.y0(window / grid.columns);
        bool touched = false;
        for (int y = 0; y < height; ++y)
          for (int x = 0; x < width; ++x)
            touched = touched ||
                      (mask[static_cast<size_t>(y * width + x)] != 0 && (x + 1) * grid.image_width > x0 * width &&
                       x * grid.image_width < (x0 + kWindow) * width && (y + 1) * grid.image_height > y0 * height &&
                       y * grid.image_height < (y0 + kWindow) * height);
        ++(touched ? within : outside);
        for (size_t o = 0; o < objects.size(); ++o)
          REQUIRE(masked.at_scale(s).decision().errors(o)[static_cast<size_t>(window)] ==
                  (touched ? whole.at_scale(s).decision().errors(o)[static_cast<size_t>(window)] : kFailed));
      }
    }
  }
  CHECK(within >= test::at_scale(100));
  CHECK(outside >= test::at_scale(100));
}

TEST_CASE("out of time, the best windows of all scales were decided on, and searched counts the rest") {
  Random random(test::seed(71));
  size_t cut_off = 0;
  for (int round = 0; round < test::rounds(10); ++round) {
    const std::vector<uint8_t> pixels = random.image(kWidth, kHeight);
    const ImageView<const uint8_t> image(pixels.data(), kWidth, kHeight, 3);
    const auto objects = database(random, pixels);
    DetectorParameters p;
    p.window_px = kWindow;
    if (round % 2) p.scales = {1, 0.7, 0.5};
    Detector whole(kWidth, kHeight, objects, p), cut(kWidth, kHeight, objects, p);
    p.last = Stage::orientation;
    Detector before(kWidth, kHeight, objects, p);
    whole.run(image);
    before.run(image);
    const auto error = [](const Detector& detector, size_t scale, size_t window, size_t object) {
      return detector.at_scale(scale).decision().errors(object)[window];
    };
    std::vector<std::tuple<float, size_t, size_t, size_t>> candidates;  // error, scale, window, object
    int windows = 0;
    for (size_t s = 0; s < before.scales(); ++s) {
      windows += before.at_scale(s).grid().windows();
      for (size_t o = 0; o < objects.size(); ++o)
        for (size_t w = 0; w < static_cast<size_t>(before.at_scale(s).grid().windows()); ++w)
          if (error(before, s, w, o) < kFailed) candidates.emplace_back(error(before, s, w, o), s, w, o);
    }
    std::sort(candidates.begin(), candidates.end());
    const auto decided = static_cast<size_t>(random.in(0, static_cast<int>(candidates.size())));
    REQUIRE(cut.run(
        image, nullptr, [] { return true; }, [&, asked = size_t{0}]() mutable { return asked++ < decided; }));
    std::set<std::pair<size_t, size_t>> open;
    for (size_t i = 0; i < candidates.size(); ++i) {
      const auto& [was, scale, window, object] = candidates[i];
      REQUIRE(error(cut, scale, window, object) == (i < decided ? error(whole, scale, window, object) : kFailed));
      if (i >= decided) open.emplace(scale, window);
    }
    CHECK(cut.searched() == doctest::Approx(1.0 - static_cast<double>(open.size()) / windows));
    cut_off += candidates.size() - decided;
  }
  CHECK(cut_off >= test::at_scale(50));
}
