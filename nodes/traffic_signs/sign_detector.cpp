// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/sign_detector.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace takt::traffic_signs {
namespace {

constexpr double kSameSign = 0.5;     // overlap from which on two sightings are one sign
constexpr double kNear = 0.3;         // of its edge a sign may move, or change in size, from image to image
constexpr size_t kMostExpected = 16;  // signs; each is looked for at a few levels
constexpr size_t kLevelsExpected = 8;

std::vector<Cascade> cascades(const std::vector<SignModel>& signs) {
  std::vector<Cascade> all;
  for (const SignModel& sign : signs) all.push_back(sign.cascade);
  return all;
}

}  // namespace

SignDetector::SignDetector(int width, int height, std::vector<SignModel> signs, const SignDetectorParameters& p)
    : signs_(std::move(signs)),
      parameters_(p),
      search_(width, height, p.scale_factor, cascades(signs_)),
      colours_(width, height),
      grey_(static_cast<size_t>(width) * static_cast<size_t>(height)),
      built_(static_cast<size_t>(search_.levels())),
      hits_(signs_.size()),
      grouping_(kMostHits) {
  size_t columns = 0;
  for (int level = search_.levels() - 1; level >= 0; --level) {
    int rows = 0;
    for (size_t sign = 0; sign < signs_.size(); ++sign) {
      if (level >= search_.levels(sign)) continue;
      rows = std::max(rows, search_.rows(sign, level));
      columns = std::max(columns, static_cast<size_t>(search_.columns(sign, level)));
    }
    for (int row = 0; row < rows; ++row) rows_.push_back({level, row});
  }
  wanted_.resize(columns);
  passed_.resize(columns);
  for (auto& hits : hits_) hits.reserve(kMostHits);
  focus_.reserve(kMostExpected * kLevelsExpected);
  sightings_.reserve(kMostHits * signs_.size());
}

bool SignDetector::begin(ImageView<const uint8_t> bgr, ImageView<const uint8_t> roi) {
  const Level& whole = search_.level(0);
  if (bgr.width != whole.width || bgr.height != whole.height || bgr.channels != 3) return false;
  roi_ = roi;
  uint8_t* grey = grey_.data();
  for (int y = 0; y < bgr.height; ++y) {
    const uint8_t* pixel = bgr.row(y);
    for (int x = 0; x < bgr.width; ++x, pixel += 3)  // ITU-R BT.601, as OpenCV rounds it
      *grey++ = static_cast<uint8_t>((pixel[0] * 1868 + pixel[1] * 9617 + pixel[2] * 4899 + (1 << 13)) >> 14);
  }
  colours_.count(bgr);
  std::fill(built_.begin(), built_.end(), uint8_t{0});
  for (auto& hits : hits_) hits.clear();
  return true;
}

/// At most kMostExpected signs, each at those levels at which its window would be up to kNear larger or smaller.
void SignDetector::focus(std::span<const Sighting> expected) {
  focus_.clear();
  for (const Sighting& sight : expected.first(std::min(expected.size(), kMostExpected))) {
    const double inner = 1 - 2 * kMargin;
    size_t levels = 0;
    for (int level = 0; level < search_.levels(sight.sign) && levels < kLevelsExpected; ++level) {
      const Box window = search_.box(sight.sign, level, 0, 0);
      const double ratio = window.width * inner / std::max(1, sight.box.width);
      if (ratio < 1 - kNear || ratio > 1 + kNear) continue;
      const Level& on = search_.level(level);
      const auto range = [&](int from, int extent, int window_extent, int count) {
        const double pitch = static_cast<double>(on.scale) * on.step, middle = from + 0.5 * (extent - window_extent);
        const auto at = [&](double position) {
          return std::clamp(static_cast<int>(std::lround(position / pitch)), 0, count - 1);
        };
        return std::pair(at(middle - kNear * extent), at(middle + kNear * extent));
      };
      const auto [left, right] = range(sight.box.x, sight.box.width, window.width, search_.columns(sight.sign, level));
      const auto [top, bottom] = range(sight.box.y, sight.box.height, window.height, search_.rows(sight.sign, level));
      focus_.push_back({sight.sign, level, top, bottom, left, right});
      ++levels;
    }
  }
}

void SignDetector::build(int level) {
  if (built_[static_cast<size_t>(level)] != 0) return;
  built_[static_cast<size_t>(level)] = 1;
  const Level& whole = search_.level(0);
  search_.build(level, {grey_.data(), whole.width, whole.height});
}

bool SignDetector::in_roi(const Box& window) const {
  if (roi_.data == nullptr) return true;
  const Level& whole = search_.level(0);
  const int x = std::min(window.x + window.width / 2, whole.width - 1) * roi_.width / whole.width,
            y = std::min(window.y + window.height / 2, whole.height - 1) * roi_.height / whole.height;
  return roi_.at(x, y) != 0;
}

bool SignDetector::has_colour(size_t sign, const Box& area, const Box& window) const {
  const SignModel& model = signs_[sign];
  return model.colour == SignColour::any ||
         colours_.pixels(model.colour, area) >= model.least_share * window.width * window.height;
}

void SignDetector::search_focus(const Focus& focus, int row) {
  build(focus.level);
  const auto columns = static_cast<size_t>(search_.columns(focus.sign, focus.level));
  std::fill_n(wanted_.begin(), columns, uint8_t{0});
  for (int column = focus.first_column; column <= focus.last_column; ++column)
    wanted_[static_cast<size_t>(column)] = in_roi(search_.box(focus.sign, focus.level, column, row));
  search_.row(focus.sign, focus.level, row, std::span(wanted_).first(columns), passed_);
  take_passed(focus.sign, focus.level, row, std::span(passed_).first(columns));
}

void SignDetector::search_row(const Row& at) {
  build(at.level);
  for (size_t sign = 0; sign < signs_.size(); ++sign) {
    if (at.level >= search_.levels(sign) || at.row >= search_.rows(sign, at.level)) continue;
    const Box first = search_.box(sign, at.level, 0, at.row);
    if (!has_colour(sign, {0, first.y, search_.level(0).width, first.height}, first))
      continue;  // not enough in all windows of the row together
    const auto columns = static_cast<size_t>(search_.columns(sign, at.level));
    bool all = roi_.data == nullptr;
    for (size_t column = 0; column < columns; ++column)
      wanted_[column] = all || in_roi(search_.box(sign, at.level, static_cast<int>(column), at.row));
    for (const Focus& f : focus_) {
      if (f.sign != sign || f.level != at.level || at.row < f.first_row || at.row > f.last_row) continue;
      std::fill(wanted_.begin() + f.first_column, wanted_.begin() + f.last_column + 1, uint8_t{0});
      all = false;
    }
    search_.row(sign, at.level, at.row, all ? std::span<const uint8_t>() : std::span(wanted_).first(columns), passed_);
    take_passed(sign, at.level, at.row, std::span(passed_).first(columns));
  }
}

/// The colour is asked of what passed: for every window it would take longer than the cascades do.
void SignDetector::take_passed(size_t sign, int level, int row, std::span<const uint8_t> passed) {
  for (size_t column = 0; column < passed.size(); ++column) {
    if (passed[column] != search_.stages(sign) || hits_[sign].size() == kMostHits) continue;
    const Box window = search_.box(sign, level, static_cast<int>(column), row);
    if (has_colour(sign, window, window)) hits_[sign].push_back(window);
  }
}

void SignDetector::end(ImageView<const uint8_t> bgr) {
  sightings_.clear();
  for (size_t sign = 0; sign < signs_.size(); ++sign) {
    const bool alone = signs_[sign].layout.columns == 0;
    for (const Group& group :
         grouping_.group(hits_[sign], alone ? parameters_.least_hits_alone : parameters_.least_hits)) {
      const auto dx = static_cast<int>(std::lround(group.box.width * kMargin)),
                 dy = static_cast<int>(std::lround(group.box.height * kMargin));
      const Box box{group.box.x + dx, group.box.y + dy, group.box.width - 2 * dx, group.box.height - 2 * dy};
      if (layout_fit(signs_[sign].layout, signs_[sign].colour, bgr, box) >= parameters_.least_fit)
        sightings_.push_back({sign, box, group.hits});
    }
  }
  std::sort(sightings_.begin(), sightings_.end(), [](const Sighting& a, const Sighting& b) {
    return std::tie(b.hits, a.sign, a.box.y, a.box.x) < std::tie(a.hits, b.sign, b.box.y, b.box.x);
  });
  size_t kept = 0;
  for (const Sighting& sighting : sightings_) {
    const bool weaker = std::any_of(
        sightings_.begin(), sightings_.begin() + static_cast<ptrdiff_t>(kept),
        [&](const Sighting& other) { return intersection_over_union(sighting.box, other.box) >= kSameSign; });
    if (!weaker && kept < kMostSightings) sightings_[kept++] = sighting;
  }
  sightings_.resize(kept);
}

}  // namespace takt::traffic_signs
