// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/box_locator.hpp"

#include <algorithm>
#include <cmath>

namespace takt::semantic {
namespace {

constexpr int kFractions = 64, kFractionOffset = 32;  // DisparityMap::fraction
constexpr double kNear = 0.06;                        // of a disparity: those of one depth

struct Range {
  int begin, end;
};
/// Pixels whose middle lies within the share of the box about its middle, within the image.
Range middle_of(double from_px, double length_px, double share, int image_px) {
  const double middle = from_px + length_px / 2, half = share * length_px / 2;
  return {std::max(0, static_cast<int>(std::ceil(middle - half))),
          std::min(image_px, static_cast<int>(std::floor(middle + half)) + 1)};
}

}  // namespace

BoxLocator::BoxLocator(size_t most_pixels, const BoxLocatorParameters& parameters) : parameters_(parameters) {
  disparities_.reserve(most_pixels);
}

int32_t BoxLocator::object_disparity() {
  const size_t count = disparities_.size();
  if (parameters_.agree > 0) {
    std::sort(disparities_.begin(), disparities_.end());
    const size_t wanted = std::max<size_t>(1, static_cast<size_t>(parameters_.agree * static_cast<double>(count)));
    for (size_t last = count; last >= wanted; --last) {
      const size_t first = last - wanted;
      if (disparities_[first] >= (1 - kNear) * disparities_[last - 1]) return disparities_[first + wanted / 2];
    }
  }
  const auto median = disparities_.begin() + static_cast<ptrdiff_t>(count / 2);
  std::nth_element(disparities_.begin(), median, disparities_.end());
  return *median;
}

std::optional<mapping_3d::Position> BoxLocator::locate(double x_px, double y_px, double width_px, double height_px,
                                                       const DisparityView& map) {
  const Range columns = middle_of(x_px, width_px, parameters_.share, map.disparity.width),
              rows = middle_of(y_px, height_px, parameters_.share, map.disparity.height);
  if (columns.begin >= columns.end || rows.begin >= rows.end) return std::nullopt;
  disparities_.clear();
  for (int y = rows.begin; y < rows.end; ++y)
    for (int x = columns.begin; x < columns.end; ++x) {
      const int16_t d = map.disparity.at(x, y);
      if (d < 0) continue;
      disparities_.push_back(kFractions * d + (map.fraction.data ? map.fraction.at(x, y) - kFractionOffset : 0));
    }
  const auto pixels = static_cast<double>(columns.end - columns.begin) * (rows.end - rows.begin);
  if (static_cast<double>(disparities_.size()) < parameters_.valid_min * pixels || disparities_.empty())
    return std::nullopt;
  const int32_t disparity = object_disparity();
  if (disparity <= 0) return std::nullopt;
  const CameraModel& c = map.camera;
  const double z_m = c.focal_px * c.baseline_m * kFractions / disparity;
  return mapping_3d::Position{(x_px + width_px / 2 - c.cu_px) * z_m / c.focal_px,
                              (y_px + height_px / 2 - c.cv_px) * z_m / c.focal_px, z_m};
}

}  // namespace takt::semantic
