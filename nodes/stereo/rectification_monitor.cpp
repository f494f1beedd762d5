// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/rectification_monitor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace takt::stereo {
namespace {

constexpr int kReach = RectificationMonitor::kReach;
constexpr int kColumns = 16, kRows = 9;  // px, of what is compared
constexpr int kLeft = kColumns / 2, kUp = kRows / 2;
constexpr int kMargin = kUp + kReach;               // rows around a point that are read
constexpr int kLeastGradient = 4;                   // grey levels per px along the column, root of the mean square
constexpr int kLeastDistinct = 4;                   // the mean of all rows differs so many times as much as the best
constexpr double kStepX = 0.7549, kStepY = 0.5698;  // spread places evenly over a cell (Roberts' sequence)

template <int kHeight>
using Patch = std::array<std::array<int16_t, kColumns>, static_cast<size_t>(kHeight)>;

/// kHeight rows from `top` on, kColumns columns around `x`; green of colour images.
template <int kHeight>
Patch<kHeight> cut(ImageView<const uint8_t> image, int x, int top) {
  Patch<kHeight> patch;
  const int channel = image.channels == 3 ? 1 : 0;
  for (int y = 0; y < kHeight; ++y) {
    const uint8_t* pixel = image.row(top + y) + ptrdiff_t{x - kLeft} * image.channels + channel;
    for (int i = 0; i < kColumns; ++i)
      patch[static_cast<size_t>(y)][static_cast<size_t>(i)] = pixel[i * image.channels];
  }
  return patch;
}

/// True if the structure of the patch (with one row more on either side) shows a shift along y, and one along x hardly.
bool shows_rows(const Patch<kRows + 2>& patch) {
  int64_t along_y = 0, mixed = 0;
  for (size_t y = 1; y <= kRows; ++y)
    for (size_t x = 1; x + 1 < kColumns; ++x) {
      const int dx = patch[y][x + 1] - patch[y][x - 1], dy = patch[y + 1][x] - patch[y - 1][x];  // twice the gradient
      along_y += dy * dy;
      mixed += dx * dy;
    }
  constexpr int64_t kLeast = int64_t{4} * kLeastGradient * kLeastGradient * kRows * (kColumns - 2);
  return along_y >= kLeast && 4 * std::abs(mixed) <= along_y;
}

/// Row of the right image, relative to the left one, that resembles it best; nothing if none stands out.
std::optional<float> row_difference(const Patch<kRows + 2>& left, const Patch<kRows + 2 * kReach>& right) {
  std::array<int, 2 * kReach + 1> cost{};
  for (size_t shift = 0; shift < cost.size(); ++shift)
    for (size_t y = 0; y < kRows; ++y)
      for (size_t x = 0; x < kColumns; ++x) {
        const int difference = left[y + 1][x] - right[y + shift][x];
        cost[shift] += difference * difference;
      }
  const auto best = std::min_element(cost.begin(), cost.end());
  int64_t sum = 0;
  for (const int c : cost) sum += c;
  if (int64_t{*best} * kLeastDistinct * static_cast<int64_t>(cost.size()) > sum) return std::nullopt;
  const auto row = static_cast<float>(best - cost.begin() - kReach);
  if (best == cost.begin() || best + 1 == cost.end()) return row;
  const int curvature = best[-1] - 2 * best[0] + best[1];
  return curvature > 0 ? row + 0.5f * static_cast<float>(best[-1] - best[1]) / static_cast<float>(curvature) : row;
}

double fraction(double value) { return value - std::floor(value); }

}  // namespace

RectificationMonitor::RectificationMonitor(int width, int height) : width_(width), height_(height) {
  const double pixels = static_cast<double>(width) * height;
  cell_ = std::max(kColumns, static_cast<int>(std::ceil(std::sqrt(pixels / kPlaces))));
  errors_.reserve(kWindow);
  scratch_.reserve(kWindow);
}

void RectificationMonitor::observe(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                                   ImageView<const int16_t> disparity) {
  const int dx = static_cast<int>(cell_ * fraction(pairs_ * kStepX)),
            dy = static_cast<int>(cell_ * fraction(pairs_ * kStepY));
  ++pairs_;
  for (int y = dy; y + kMargin < height_; y += cell_)
    for (int x = dx; x + kLeft < width_; x += cell_) {
      if (y < kMargin || x < kLeft) continue;
      const int d = disparity.at(x, y);
      if (d < 0 || x - d < kLeft) continue;
      const auto patch = cut<kRows + 2>(left, x, y - kUp - 1);
      if (!shows_rows(patch)) continue;
      if (const auto rows = row_difference(patch, cut<kRows + 2 * kReach>(right, x - d, y - kMargin)))
        add(std::abs(*rows));
    }
}

void RectificationMonitor::add(float error_px) {
  if (errors_.size() < kWindow) return errors_.push_back(error_px);
  errors_[oldest_] = error_px;
  oldest_ = (oldest_ + 1) % kWindow;
}

std::optional<double> RectificationMonitor::row_error_px() {
  if (errors_.size() < kLeastPoints) return std::nullopt;
  scratch_ = errors_;
  const auto middle = scratch_.begin() + static_cast<ptrdiff_t>(scratch_.size() / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.end());
  return *middle;
}

std::optional<RowTrust> RowErrorAlarm::update(double row_error_px) {
  const RowTrust now = row_error_px > kWrong      ? RowTrust::wrong
                       : row_error_px > kDoubtful ? RowTrust::doubtful
                                                  : RowTrust::good;
  if (row_error_px < kOver) told_ = RowTrust::good;
  if (now <= told_) return std::nullopt;
  told_ = now;
  return now;
}

}  // namespace takt::stereo
