// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt/time/clock.hpp"

namespace takt::object_detection {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();

double share_pct(const std::vector<float>& factors, double at_least) {
  if (factors.empty()) return 0;
  const auto count = std::count_if(factors.begin(), factors.end(), [&](float f) { return f >= at_least; });
  return 100.0 * static_cast<double>(count) / static_cast<double>(factors.size());
}

bool covers_half(const SearchGrid& grid, int window, const PlacedObject& object) {
  const auto common = [&](int from, int object_from) {
    return std::max(0, std::min(from + grid.window_px, object_from + object.side) - std::max(from, object_from));
  };
  const int x = common(grid.x0(window % grid.columns), object.x), y = common(grid.y0(window / grid.columns), object.y);
  return 2 * x * y >= object.side * object.side;
}

}  // namespace

Exclusion Measurement::at(double factor) const {
  return {share_pct(window_factor, factor), share_pct(object_factor, factor)};
}

double Measurement::no_miss_factor() const {
  if (object_factor.empty()) return 0;
  return std::nextafter(*std::max_element(object_factor.begin(), object_factor.end()), kNever);
}

void measure(const Scene& scene, const SearchGrid& grid, size_t objects, WindowTest& test, Measurement& measurement) {
  test.search(scene);
  std::vector<float> of_placed(scene.objects.size(), kNever);
  for (int window = 0; window < grid.windows(); ++window) {
    float any = kNever;
    for (size_t object = 0; object < objects; ++object) any = std::min(any, test.factor(window, object));
    measurement.window_factor.push_back(any);
    bool covering = false;
    for (size_t i = 0; i < scene.objects.size(); ++i) {
      if (!covers_half(grid, window, scene.objects[i])) continue;
      covering = true;
      of_placed[i] = std::min(of_placed[i], test.factor(window, scene.objects[i].object));
    }
    measurement.covering_windows += covering;
  }
  measurement.object_factor.insert(measurement.object_factor.end(), of_placed.begin(), of_placed.end());
}

void ColourStageTest::search(const Scene& scene) {
  const int64_t start = thread_cpu_ns();
  detector_.run(scene.view());
  times_ms_.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
}

float ColourStageTest::factor(int window, size_t object) const {
  const auto& limits = detector_.limits(Stage::colour);
  size_t references = 0, first = 0;
  for (size_t o = 0; o < limits.size(); ++o) {
    if (o == object) first = references;
    references += limits[o].size();
  }
  const uint16_t* missing = detector_.at_scale(0).missing().data() + static_cast<size_t>(window) * references + first;
  double best = kNever;
  for (const ReferenceLimit& limit : limits[object])
    best = std::min(best, *missing++ / (limit.threshold * static_cast<double>(limit.mass)));
  return static_cast<float>(best);
}

MeanColourTest::MeanColourTest(const SearchGrid& grid, std::span<const DatabaseObject> database) : grid_(grid) {
  for (const DatabaseObject& object : database) {
    auto& views = objects_.emplace_back();
    for (const ReferenceView& view : object.views) views.push_back(mean(view.view(), 0, 0, view.side_px));
  }
}

/// Black pixels add nothing to the sums, so the background of a view leaves itself out.
MeanColourTest::Chromaticity MeanColourTest::mean(ImageView<const uint8_t> image, int x0, int y0, int side) {
  double blue = 0, green = 0, red = 0;
  for (int y = y0; y < y0 + side; ++y) {
    for (int x = x0; x < x0 + side; ++x) {
      blue += image.at(x, y, 0);
      green += image.at(x, y, 1);
      red += image.at(x, y, 2);
    }
  }
  const double sum = std::max(1.0, blue + green + red);
  return {blue / sum, green / sum, red / sum};
}

void MeanColourTest::search(const Scene& scene) {
  windows_.clear();
  for (int window = 0; window < grid_.windows(); ++window)
    windows_.push_back(
        mean(scene.view(), grid_.x0(window % grid_.columns), grid_.y0(window / grid_.columns), grid_.window_px));
}

float MeanColourTest::factor(int window, size_t object) const {
  const Chromaticity& w = windows_[static_cast<size_t>(window)];
  double nearest = kNever;
  for (const Chromaticity& view : objects_[object])
    nearest = std::min(nearest, std::hypot(w.blue - view.blue, w.green - view.green, w.red - view.red));
  return static_cast<float>(nearest);
}

}  // namespace takt::object_detection
