// SPDX-License-Identifier: Apache-2.0
// Whether epipolar lines still are rows: a knock, a warm lens or a loose screw turns one camera against the other, and
// nothing else tells.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Measures by how many rows matched points of a rectified pair differ. Memory is taken by the constructor; one thread
/// at a time.
class RectificationMonitor {
 public:
  static constexpr int kPlaces = 300;     ///< that are looked at in one pair, about
  static constexpr int kReach = 3;        ///< px up and down: larger errors count as this, where they are seen at all
  static constexpr size_t kWindow = 600;  ///< points that the median is taken of, the newest
  static constexpr size_t kLeastPoints = 60;

  /// For pairs of that size, px.
  RectificationMonitor(int width, int height);

  /// Looks at one place in each cell of a grid, another one in each pair. A place counts where the left image changes
  /// along its column (and not along a diagonal, where an error in x would look like one in y), has a disparity, and
  /// where one of the rows of the right image resembles it far more than the others; a parabola through the squared
  /// differences of three rows gives the row to a fraction. Views have the size given, 1 or 3 channels alike.
  void observe(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<const int16_t> disparity);

  /// Median of |row in the right image - row in the left|, px; nothing while there are less than kLeastPoints.
  std::optional<double> row_error_px();
  /// Points that the median is taken of.
  size_t points() const { return errors_.size(); }

 private:
  void add(float error_px);

  int width_, height_, cell_ = 0;
  uint32_t pairs_ = 0;
  std::vector<float> errors_;  ///< |px|, a ring of kWindow
  size_t oldest_ = 0;
  std::vector<float> scratch_;
};

/// How far a rectified pair can be trusted.
enum class RowTrust : uint8_t { good, doubtful, wrong };

/// Turns row errors into what is worth telling: each state once in an episode, which lasts until the error is small
/// again.
class RowErrorAlarm {
 public:
  static constexpr double kDoubtful = 0.5, kWrong = 1.0, kOver = 0.4;  ///< px

  /// Doubtful or wrong where that is worse than what was told in this episode.
  std::optional<RowTrust> update(double row_error_px);

 private:
  RowTrust told_ = RowTrust::good;
};

}  // namespace takt::stereo
