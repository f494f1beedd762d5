// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "nodes/object_detection/byte_references.hpp"
#include "nodes/object_detection/cooccurrence_stage.hpp"
#include "nodes/object_detection/histogram_kernels.hpp"
#include "nodes/object_detection/orientation_stage.hpp"
#include "nodes/object_detection/reference.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/object_detection/random_images.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::object_detection;
using takt::test::on_each_target;
using takt::test::Random;

namespace {

/// Views cut out of the image itself and, so that some bins are found nowhere, out of another one.
template <class HistogramOf>
std::vector<std::vector<Histogram>> references(Random& random, ImageView<const uint8_t> image, int side,
                                               const HistogramOf& histogram_of) {
  std::vector<std::vector<Histogram>> objects(static_cast<size_t>(random.in(1, 4)));
  const std::vector<uint8_t> other = random.image(image.width, image.height);
  for (auto& views : objects)
    for (int k = random.in(1, 5); k > 0; --k) {
      const uint8_t* from = random.in(0, 2) ? image.data : other.data();
      const ImageView<const uint8_t> all(from, image.width, image.height, 3);
      const int x = random.in(0, image.width - side), y = random.in(0, image.height - side);
      views.push_back(histogram_of({&all.at(x, y), side, side, 3, all.stride}));
    }
  return objects;
}

}  // namespace

TEST_CASE("every possible gradient gets the orientation that the arctangent gives it") {
  for (const int orientations : {4, 8, 32, 180, 360}) {
    const OrientationBins bins(orientations);
    int64_t wrong = 0;
    for (int gy = -1020; gy <= 1020; ++gy) {
      for (int gx = -1020; gx <= 1020; ++gx) {
        if (std::hypot(gx, gy) < OrientationBins::kShortest) {
          wrong += bins.of(gx, gy) != bins.none();
          continue;
        }
        const double turn = std::atan2(gy, gx) / (2 * std::numbers::pi);
        wrong += bins.of(gx, gy) !=
                 static_cast<int>(std::floor((turn < 0 ? turn + 1 : turn) * orientations + 1e-9)) % orientations;
      }
    }
    CAPTURE(orientations);
    CHECK(wrong == 0);
  }
}

TEST_CASE("every possible gradient gets the same from the vectorised form, with each SIMD target") {
  // Only sideways neighbours give Gx = 2 (right - left), diagonals every sum in between.
  Random random(test::seed(3));
  constexpr size_t kWidth = 4099;
  std::vector<uint8_t> rows[3];
  for (auto& row : rows) row.resize(kWidth);
  std::vector<uint16_t> fast(kWidth), slow(kWidth);
  for (const int orientations : {8, 32, 180, 360}) {
    const OrientationBins bins(orientations);
    for (int round = 0; round < test::rounds(200); ++round) {
      const int contrast = random.in(8, 255);
      for (auto& row : rows)
        for (uint8_t& value : row) value = static_cast<uint8_t>(random.byte() % contrast);
      std::fill(slow.begin(), slow.end(), bins.none());
      for (size_t x = 1; x + 1 < kWidth; ++x) {
        const uint8_t *a = &rows[0][x], *o = &rows[1][x], *b = &rows[2][x];
        slow[x] = bins.of(a[1] + 2 * o[1] + b[1] - a[-1] - 2 * o[-1] - b[-1],
                          b[-1] + 2 * b[0] + b[1] - a[-1] - 2 * a[0] - a[1]);
      }
      on_each_target([&] {
        bins.row(rows[0].data(), rows[1].data(), rows[2].data(), kWidth, fast.data());
        REQUIRE(fast == slow);
      });
    }
  }
}

TEST_CASE("references as bytes lack what their counts lack, also above 255, with each SIMD target") {
  Random random(test::seed(53));
  for (int round = 0; round < test::rounds(60); ++round) {
    const auto slots = static_cast<size_t>(random.in(1, 300));
    // Mostly nothing, else few or many: up to more than nine bytes hold.
    const auto counts = [&](size_t size) {
      ByteReferences::Counts counts(size);
      for (uint16_t& count : counts)
        if (random.in(0, 2) == 0) count = static_cast<uint16_t>(random.in(0, random.in(0, 9) == 0 ? 2600 : 20));
      for (int left = UINT16_MAX; uint16_t & count : counts)
        left -= count = std::min<uint16_t>(count, static_cast<uint16_t>(left));
      return counts;
    };
    std::vector<std::vector<ByteReferences::Counts>> objects(static_cast<size_t>(random.in(0, 4)));
    for (auto& references : objects)
      for (int k = random.in(0, 9); k > 0; --k)
        references.push_back(counts(static_cast<size_t>(random.in(0, static_cast<int>(slots)))));
    on_each_target([&] {
      ByteReferences bytes(slots, objects);
      for (int k = 0; k < 4; ++k) {
        ByteReferences::Counts window = counts(slots);
        window.resize((slots + kLaneBlock - 1) / kLaneBlock * kLaneBlock);
        bytes.take(window);
        for (size_t object = 0; object < objects.size(); ++object) {
          REQUIRE(bytes.references(object) == objects[object].size());
          std::vector<uint16_t> missing(objects[object].size());
          bytes.missing(object, missing.data());
          for (size_t r = 0; r < missing.size(); ++r) {
            uint32_t lacks = 0;
            for (size_t slot = 0; slot < objects[object][r].size(); ++slot)
              lacks += static_cast<uint32_t>(std::max(0, objects[object][r][slot] - window[slot]));
            REQUIRE(missing[r] == lacks);
          }
        }
      }
    });
  }
}

TEST_CASE("the orientation stage equals counting and comparing everything, for any grid and any windows asked for") {
  Random random(test::seed(17));
  for (int round = 0; round < test::rounds(40); ++round) {
    const int window = random.in(5, 70), reference = random.in(std::max(4, window / 3), window - 1);
    const int width = random.in(window, 150), height = random.in(window, 130);
    const int orientations = std::array{4, 8, 32, 180, 360}[static_cast<size_t>(random.in(0, 4))];
    const SearchGrid grid = make_search_grid(width, height, reference, window);
    if (grid.windows() > 2500) continue;
    const OrientationBins bins(orientations);
    const std::vector<uint8_t> pixels = random.image(width, height);
    const ImageView<const uint8_t> image(pixels.data(), width, height, 3);
    const auto objects = references(random, image, reference,
                                    [&](ImageView<const uint8_t> view) { return orientation_histogram(view, bins); });
    OrientationStage stage(grid, bins, objects);
    on_each_target([&] {
      stage.begin(image);
      const int first_row = random.in(0, grid.rows - 1);
      for (int row = 0; row < grid.rows; ++row) {
        const int v = (first_row + row) % grid.rows;
        for (int u = 0; u < grid.columns; ++u) {
          if (random.in(0, 30) != 0) continue;  // few windows pass
          stage.go_to(static_cast<size_t>(v * grid.columns + u));
          const auto object = static_cast<size_t>(random.in(0, static_cast<int>(objects.size()) - 1));
          const auto slow = orientation_window_reference(image, grid.x0(u), grid.y0(v), window, orientations);
          const auto fast = stage.missing(object);
          REQUIRE(fast.size() == objects[object].size());
          for (size_t r = 0; r < fast.size(); ++r) REQUIRE(fast[r] == missing_mass(slow, objects[object][r].count));
        }
      }
    });
  }
}

TEST_CASE("co-occurrences equal looking at every pair of pixels, with each SIMD target") {
  Random random(test::seed(29));
  for (int round = 0; round < test::rounds(60); ++round) {
    const int side = round < 3 ? 70 + round : random.in(1, 40);  // beyond one vector, too
    const PairBins bins{random.in(1, CooccurrenceCounter::kMaxColours), random.in(1, kMaxDistance)};
    CAPTURE(side);
    CAPTURE(bins.colours);
    CAPTURE(bins.distances);
    std::vector<uint8_t> colour(static_cast<size_t>(side * side));
    const int used = random.in(1, bins.colours + 4);  // some beyond the colours that count
    for (uint8_t& c : colour) c = random.in(0, 9) == 0 ? uint8_t{255} : static_cast<uint8_t>(random.in(0, used - 1));
    if (round % 5 == 0) std::fill(colour.begin(), colour.end(), uint8_t{0});
    const auto slow = cooccurrence_reference(colour, side, bins);
    CooccurrenceCounter counter(side, bins.distances);
    std::vector<uint32_t> fast(slow.size(), 7);
    on_each_target([&] {
      counter.count(colour.data(), bins.colours, fast.data());
      REQUIRE(fast == slow);
    });
  }
}

TEST_CASE("the co-occurrence stage equals counting and comparing everything") {
  Random random(test::seed(41));
  for (int round = 0; round < test::rounds(12); ++round) {
    const int window = random.in(8, 48), reference = random.in(std::max(4, window / 2), window - 1);
    const int width = random.in(window, 120), height = random.in(window, 100);
    const SearchGrid grid = make_search_grid(width, height, reference, window);
    const PairBins bins{round % 2 ? 20 : 5, round % 3 ? 25 : 5};
    const std::vector<uint8_t> pixels = random.image(width, height);
    const ImageView<const uint8_t> image(pixels.data(), width, height, 3);
    const auto objects = references(random, image, reference,
                                    [&](ImageView<const uint8_t> view) { return cooccurrence_histogram(view, bins); });
    CooccurrenceStage stage(grid, bins, objects);
    on_each_target([&] {
      for (int k = 0; k < 10; ++k) {
        const int u = random.in(0, grid.columns - 1), v = random.in(0, grid.rows - 1);
        const auto object = static_cast<size_t>(random.in(0, static_cast<int>(objects.size()) - 1));
        const auto slow = cooccurrence_window_reference(image, grid.x0(u), grid.y0(v), window, bins);
        const auto fast = stage.missing(image, static_cast<size_t>(v * grid.columns + u), object);
        REQUIRE(fast.size() == objects[object].size());
        for (size_t r = 0; r < fast.size(); ++r) REQUIRE(fast[r] == missing_mass(slow, objects[object][r].count));
      }
    });
  }
}

TEST_CASE("all 16.7 million colours get the same co-occurrence colour from the vectorised form") {
  std::vector<uint8_t> colours(3 * 65536), fast(65536), slow(65536);
  for (const int n : {5, 20}) {
    for (int blue = 0; blue < 256; ++blue) {
      for (size_t i = 0; i < 65536; ++i) {
        colours[3 * i] = static_cast<uint8_t>(blue);
        colours[3 * i + 1] = static_cast<uint8_t>(i >> 8);
        colours[3 * i + 2] = static_cast<uint8_t>(i);
        slow[i] = pair_colour(colours[3 * i], colours[3 * i + 1], colours[3 * i + 2], n);
      }
      on_each_target([&] {
        pair_colours(colours.data(), 65535, n, fast.data());  // an odd length: the rest is done one by one
        fast[65535] = slow[65535];
        REQUIRE(fast == slow);
      });
    }
  }
}
