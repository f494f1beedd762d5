// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/search.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace takt::traffic_signs {
namespace {

constexpr float kThresholdMargin = 1e-5f;  // below a stage's threshold a window still passes: OpenCV's allowance

int levels_for(int width, int height, double factor, std::span<const Cascade> cascades) {
  if (!(factor > 1))
    throw std::invalid_argument("the factor between scales is " + std::to_string(factor) + ", must be above 1");
  int most = 0;
  for (const Cascade& cascade : cascades) {
    const int levels = scales(width, height, factor, cascade.width, cascade.height);
    if (levels == 0)
      throw std::invalid_argument("a cascade's window of " + std::to_string(cascade.width) + " x " +
                                  std::to_string(cascade.height) + " px does not fit into an image of " +
                                  std::to_string(width) + " x " + std::to_string(height) + " px");
    most = std::max(most, levels);
  }
  return most;
}

Corners corners(const Level& level, int x, int y, int width, int height) {
  const auto at = [&](int dx, int dy) { return static_cast<int32_t>(level.at(x + dx, y + dy)); };
  return {at(0, 0), at(width, 0), at(0, height), at(width, height)};
}

}  // namespace

Search::Search(int width, int height, double factor, std::span<const Cascade> cascades)
    : pyramid_(width, height, factor, levels_for(width, height, factor, cascades)) {
  for (const Cascade& cascade : cascades) {
    windows_.push_back({cascade.width, cascade.height, cascade.stages.size()});
    auto& levels = placed_.emplace_back();
    for (int i = 0; i < scales(width, height, factor, cascade.width, cascade.height); ++i)
      levels.push_back(place(cascade, level(i)));
  }
}

Search::Placed Search::place(const Cascade& cascade, const Level& level) {
  Placed placed;
  for (const Stage& stage : cascade.stages) {
    placed.stages.push_back({static_cast<uint32_t>(stage.stumps.size()), stage.threshold - kThresholdMargin});
    for (const Stump& stump : stage.stumps) {
      PlacedStump& out = placed.stumps.emplace_back();
      out.threshold = stump.threshold;
      out.below = stump.below;
      out.otherwise = stump.otherwise;
      const HaarFeature& feature = cascade.features[static_cast<size_t>(stump.feature)];
      for (size_t i = 0; i < feature.size(); ++i) {
        out.rects[i] = corners(level, feature[i].x, feature[i].y, feature[i].width, feature[i].height);
        out.weights[i] = feature[i].weight;
      }
    }
  }
  const int width = cascade.width - 2, height = cascade.height - 2;
  placed.inner = corners(level, 1, 1, width, height);
  placed.inner_area = width * height;
  return placed;
}

int Search::columns(size_t cascade, int index) const {
  return level(index).windows(level(index).width, windows_[cascade].width);
}

int Search::rows(size_t cascade, int index) const {
  return level(index).windows(level(index).height, windows_[cascade].height);
}

void Search::row(size_t cascade, int index, int row, std::span<const uint8_t> wanted, std::span<uint8_t> passed) const {
  const Placed& placed = placed_[cascade][static_cast<size_t>(index)];
  const Level& on = level(index);
  const ptrdiff_t start = on.at(0, row * on.step);
  pass_windows({placed.stumps, placed.stages, placed.inner, placed.inner_area}, on.sums() + start, on.squares() + start,
               columns(cascade, index), wanted.empty() ? nullptr : wanted.data(), passed.data());
}

Box Search::box(size_t cascade, int index, int column, int row) const {
  const Level& on = level(index);
  const auto scaled = [&](int value) { return static_cast<int>(std::nearbyint(static_cast<float>(value) * on.scale)); };
  return {scaled(column * on.step), scaled(row * on.step), scaled(windows_[cascade].width),
          scaled(windows_[cascade].height)};
}

std::vector<Box> detect_multi_scale(Search& search, size_t cascade, ImageView<const uint8_t> grey) {
  std::vector<Box> boxes;
  std::vector<uint8_t> passed;
  for (int level = 0; level < search.levels(cascade); ++level) {
    search.build(level, grey);
    const int columns = search.columns(cascade, level);
    passed.resize(static_cast<size_t>(columns));
    for (int row = 0; row < search.rows(cascade, level); ++row) {
      search.row(cascade, level, row, {}, passed);
      for (int column = 0; column < columns; ++column) {
        const uint8_t stages = passed[static_cast<size_t>(column)];
        if (stages == search.stages(cascade)) {
          Box& box = boxes.emplace_back(search.box(cascade, level, column, row));
          box.width = std::min(box.width, grey.width - box.x);  // a rounding may lead beyond the border
          box.height = std::min(box.height, grey.height - box.y);
        }
        column += stages == 0;
      }
    }
  }
  return boxes;
}

}  // namespace takt::traffic_signs
