// SPDX-License-Identifier: Apache-2.0
// Whether epipolar lines still are rows: a knock, a warm lens or a loose screw turns one camera against the other, and
// nothing else tells.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::stereo {

/// Measures by how many rows matched points of a rectified pair differ. Memory is taken by the constructor; one thread
/// at a time.
class RectificationMonitor {
 public:
  static constexpr int kPlaces = 300;     ///< that are looked at in one pair, about
  static constexpr int kReach = 3;        ///< px up and down where the disparity says
  static constexpr int kFarReach = 16;    ///< px up and down where it says nothing of use
  static constexpr int kFarPlaces = 8;    ///< of one pair that are searched so far, at most
  static constexpr size_t kWindow = 600;  ///< points that the median is taken of, the newest
  static constexpr size_t kLeastPoints = 60;

  /// For pairs of that size, px, and points with disparities 0 .. disparities - 1.
  RectificationMonitor(int width, int height, int disparities);

  /// Looks at one place in each cell of a grid, another one in each pair. A place counts where the left image changes
  /// along its column (and not along a diagonal, where an error in x would look like one in y), has a disparity, and
  /// where one of the rows of the right image resembles it far more than the others; a parabola through the squared
  /// differences of three rows gives the row to a fraction. Where most places with such structure have no distinct row,
  /// disparities are not to be believed either: some of these places are then looked for in all columns of the search
  /// range and many rows, whatever their disparity. Views have the size given, 1 or 3 channels alike.
  void observe(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<const int16_t> disparity);

  /// Median of |row in the right image - row in the left|, px; nothing while there are less than kLeastPoints.
  std::optional<double> row_error_px();
  /// Points that the median is taken of.
  size_t points() const { return errors_.size(); }
  void remember(StateArchive& archive) { TAKT_STATE(archive, pairs_, errors_, oldest_); }

 private:
  struct Place {
    int x, y;
  };
  void add(float error_px);
  /// The place's point in the right image, found without a disparity: row relative to the left one's; nothing if no
  /// place of the right image resembles it far more than the others.
  std::optional<float> far_row(ImageView<const uint8_t> left, ImageView<const uint8_t> right, Place place);

  int width_, height_, disparities_, cell_ = 0;
  uint32_t pairs_ = 0;
  std::vector<float> errors_;  ///< |px|, a ring of kWindow
  size_t oldest_ = 0;
  std::vector<float> scratch_;
  std::vector<Place> lost_;     ///< with structure, without a distinct row, of one pair
  std::vector<uint8_t> strip_;  ///< of the right image, around one place
  std::vector<int> far_costs_;  ///< by row, then column
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
  void remember(StateArchive& archive) { TAKT_STATE(archive, told_); }

 private:
  RowTrust told_ = RowTrust::good;
};

}  // namespace takt::stereo
