// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/rectification_monitor.hpp"

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <cstdlib>

namespace takt::stereo {
namespace {

constexpr int kReach = RectificationMonitor::kReach;
constexpr int kColumns = 16, kRows = 9;  // px, of what is compared
constexpr int kLeft = kColumns / 2, kUp = kRows / 2;
constexpr int kMargin = kUp + kReach;  // rows around a point that are read
constexpr int kLeastGradient = 4;      // grey levels per px along the column, root of the mean square
constexpr int kLeastDistinct = 4;      // the mean of all rows differs so many times as much as the best
constexpr int kFarDistinct = 2;        // the next best place of a wide search differs so many times as much
constexpr int kFarMargin = kUp + RectificationMonitor::kFarReach + kReach;  // rows around a point that it reads
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

/// Row of the right image, relative to the left one, that resembles it best; nothing if none stands out, or if it is
/// the last one looked at: beyond may lie a better one.
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
  if (best == cost.begin() || best + 1 == cost.end()) return std::nullopt;
  const auto row = static_cast<float>(best - cost.begin() - kReach);
  const int curvature = best[-1] - 2 * best[0] + best[1];
  return curvature > 0 ? row + 0.5f * static_cast<float>(best[-1] - best[1]) / static_cast<float>(curvature) : row;
}

/// Sum of absolute differences of the inner rows of the left patch and what begins at `right`.
int patch_difference(const uint8_t* left, const uint8_t* right, size_t stride) {
  int sum = 0;
  for (int y = 0; y < kRows; ++y, left += kColumns, right += stride)
    for (int x = 0; x < kColumns; ++x) sum += std::abs(left[x] - right[x]);
  return sum;
}

double fraction(double value) { return value - std::floor(value); }

}  // namespace

RectificationMonitor::RectificationMonitor(int width, int height, int disparities)
    : width_(width), height_(height), disparities_(disparities) {
  const double pixels = static_cast<double>(width) * height;
  cell_ = std::max(kColumns, static_cast<int>(std::ceil(std::sqrt(pixels / kPlaces))));
  errors_.reserve(kWindow);
  scratch_.reserve(kWindow);
  lost_.reserve(static_cast<size_t>(width / cell_ + 1) * static_cast<size_t>(height / cell_ + 1));
  strip_.resize(static_cast<size_t>(disparities + kColumns) * (2 * kFarReach + kRows));
  far_costs_.resize(static_cast<size_t>(disparities) * (2 * kFarReach + 1));
}

void RectificationMonitor::observe(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                                   ImageView<const int16_t> disparity) {
  const int dx = static_cast<int>(cell_ * fraction(pairs_ * kStepX)),
            dy = static_cast<int>(cell_ * fraction(pairs_ * kStepY));
  ++pairs_;
  size_t structured = 0;
  lost_.clear();
  for (int y = dy; y + kMargin < height_; y += cell_)
    for (int x = dx; x + kLeft < width_; x += cell_) {
      if (y < kMargin || x < kLeft) continue;
      const auto patch = cut<kRows + 2>(left, x, y - kUp - 1);
      if (!shows_rows(patch)) continue;
      ++structured;
      const int d = disparity.at(x, y);
      std::optional<float> rows;
      if (d >= 0 && x - d >= kLeft) rows = row_difference(patch, cut<kRows + 2 * kReach>(right, x - d, y - kMargin));
      if (rows) add(std::abs(*rows));
      else if (y >= kFarMargin && y + kFarMargin < height_) lost_.push_back({x, y});
    }
  if (4 * lost_.size() < 3 * structured) return;
  const size_t step = std::max(size_t{1}, (lost_.size() + kFarPlaces - 1) / kFarPlaces);
  for (size_t i = 0; i < lost_.size(); i += step)
    if (const auto rows = far_row(left, right, lost_[i])) add(std::abs(*rows));
}

std::optional<float> RectificationMonitor::far_row(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                                                   Place place) {
  const auto [x, y] = place;
  const int columns = std::min(disparities_, x - kLeft + 1), rows = 2 * kFarReach + 1;
  const auto stride = static_cast<size_t>(columns - 1 + kColumns);
  const auto copy = [](ImageView<const uint8_t> image, int from_x, int from_y, size_t width, int height, uint8_t* out) {
    const int channel = image.channels == 3 ? 1 : 0;
    for (int row = 0; row < height; ++row, out += width) {
      const uint8_t* pixel = image.row(from_y + row) + ptrdiff_t{from_x} * image.channels + channel;
      for (size_t i = 0; i < width; ++i) out[i] = pixel[i * static_cast<size_t>(image.channels)];
    }
  };
  std::array<uint8_t, kColumns * kRows> wanted;
  copy(left, x - kLeft, y - kUp, kColumns, kRows, wanted.data());
  copy(right, x - kLeft - (columns - 1), y - kUp - kFarReach, stride, rows - 1 + kRows, strip_.data());
  const auto cost = [&](int row, int column) -> int& {
    return far_costs_[static_cast<size_t>(row * columns + column)];
  };
  int best_row = 0, best_column = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      cost(row, column) =
          patch_difference(wanted.data(), strip_.data() + static_cast<size_t>(row) * stride + column, stride);
      if (cost(row, column) < cost(best_row, best_column)) best_row = row, best_column = column;
    }
  int second = INT_MAX;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      if (std::abs(row - best_row) > 2 || std::abs(column - best_column) > 2)
        second = std::min(second, cost(row, column));
  if (second < kFarDistinct * cost(best_row, best_column)) return std::nullopt;
  const int down = best_row - kFarReach, d = columns - 1 - best_column;
  const auto rest =
      row_difference(cut<kRows + 2>(left, x, y - kUp - 1), cut<kRows + 2 * kReach>(right, x - d, y + down - kMargin));
  if (!rest) return std::nullopt;
  return static_cast<float>(down) + *rest;
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
