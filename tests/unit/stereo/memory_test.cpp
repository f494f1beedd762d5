// SPDX-License-Identifier: Apache-2.0
// Memory is taken when an object is made: from the first call on nothing is allocated, and once its memory has been
// touched no page is missing.
#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "nodes/stereo/band_matcher.hpp"
#include "nodes/stereo/generated_pair.hpp"
#include "nodes/stereo/half_resolution.hpp"
#include "nodes/stereo/rectification_monitor.hpp"
#include "nodes/stereo/rectify.hpp"
#include "nodes/stereo/window_matcher.hpp"
#include "rt/memory/memory_use.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

constexpr int kPairWidth = 330, kPairHeight = 90;  // more than one strip of columns

/// Of the calls after the first the one with the fewest: now and then the kernel itself takes a page away.
void expect_no_memory(const std::string& what, const std::function<void()>& call) {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  CAPTURE(what);
  const uint64_t before = thread_memory_use().allocations;
  call();
  CHECK(thread_memory_use().allocations == before);
  uint64_t fewest = UINT64_MAX;
  for (int i = 0; i < 3; ++i) {
    const MemoryUse start = thread_memory_use();
    call();
    const MemoryUse use = thread_memory_use() - start;
    CHECK(use.allocations == 0);
    fewest = std::min(fewest, use.page_faults);
  }
  CHECK(fewest == 0);
}

struct MemoryScene {
  GeneratedPair pair = generate_pair(kPairWidth, kPairHeight, 60, 30, 2, 1);
  std::vector<int16_t> disparity = std::vector<int16_t>(kPairWidth * kPairHeight);
  std::vector<uint8_t> confidence = std::vector<uint8_t>(kPairWidth * kPairHeight), fraction = confidence;
  DisparityViews views() {
    return {{disparity.data(), kPairWidth, kPairHeight},
            {confidence.data(), kPairWidth, kPairHeight},
            {fraction.data(), kPairWidth, kPairHeight}};
  }
};

void expect_no_memory(const std::string& what, Matcher& matcher, MemoryScene& scene) {
  int range = 60;
  expect_no_memory(what, [&] {
    CHECK(matcher.match(scene.pair.left_view(), scene.pair.right_view(), scene.views()));
    matcher.limit_search(range ^= 60 ^ 30);  // narrower and wide again
  });
}

}  // namespace

TEST_CASE("matching allocates nothing and misses no page: windows, paths, half resolution, bands, all else") {
  MemoryScene scene;
  MatcherParameters windows, checked, paths = MatcherParameters::quality(), general;
  checked.left_right_check = checked.subpixel = checked.median = true;
  checked.uniqueness = 20;
  paths.left_right_check = paths.subpixel = true;
  general.cost = CostKind::mixed;
  general.intensity_weight = 0.5;
  general.aggregation = Aggregation::boundary;
  general.n_min = 1;
  const std::pair<const char*, MatcherParameters*> all[] = {
      {"windows", &windows}, {"windows, every check", &checked}, {"paths", &paths}, {"general", &general}};
  for (const auto& [name, parameters] : all) {
    parameters->disparities = 60;
    expect_no_memory(name, *make_matcher(kPairWidth, kPairHeight, 3, *parameters), scene);
    HalfMatcher half_matcher(kPairWidth, kPairHeight, 3, *parameters);
    expect_no_memory(std::string(name) + ", half resolution", half_matcher, scene);
    if (!WindowMatcher::serves(*parameters)) continue;
    BandMatcher bands(kPairWidth, kPairHeight, 3, *parameters, 2);
    expect_no_memory(std::string(name) + ", two bands", bands, scene);
  }
}

TEST_CASE("rectifying and watching rows allocate nothing and miss no page") {
  MemoryScene scene;
  StereoCalibration cameras;
  cameras.width = kPairWidth;
  cameras.height = kPairHeight;
  cameras.left_matrix = cameras.right_matrix = {300, 0, 165, 0, 300, 45, 0, 0, 1};
  cameras.left_distortion = cameras.right_distortion = {-0.1, 0.01, 0, 0, 0};
  cameras.translation_m = {-0.24, 0, 0};
  std::vector<uint8_t> left(kPairWidth * kPairHeight * 3), right = left;
  for (const BayerPattern pattern : {BayerPattern::none, BayerPattern::rggb}) {
    Rectifier rectifier(cameras, pattern);
    const int channels = pattern == BayerPattern::none ? 3 : 1;
    expect_no_memory("rectifier", [&] {
      CHECK(rectifier.rectify({scene.pair.left.data(), kPairWidth, kPairHeight, channels},
                              {scene.pair.right.data(), kPairWidth, kPairHeight, channels},
                              {left.data(), kPairWidth, kPairHeight, 3}, {right.data(), kPairWidth, kPairHeight, 3}));
    });
  }
  RectificationMonitor monitor(kPairWidth, kPairHeight, 60);
  std::vector<int16_t> truth;
  for (const float d : scene.pair.truth.pixels) truth.push_back(static_cast<int16_t>(d));
  expect_no_memory("monitor", [&] {
    for (int i = 0; i < 10; ++i)
      monitor.observe(scene.pair.left_view(), scene.pair.right_view(), {truth.data(), kPairWidth, kPairHeight});
    CHECK(monitor.row_error_px());
  });
}
