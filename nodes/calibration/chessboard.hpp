// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <vector>

namespace takt::calibration {

/// A chessboard, counted in inner corners: 9 x 6 has 10 x 7 squares.
struct Board {
  int columns = 9, rows = 6;
  double square = 1;  ///< edge of a square; what it is measured in, the translation between the cameras is, too

  int corners() const { return columns * rows; }
};

/// The corners on the board (z = 0), row by row.
std::vector<cv::Point3f> board_points(const Board& board);

/// The corners in a grey image, px, in the order of board_points from either end of the board; empty if not all of them
/// are seen. Their accuracy is that of cv::cornerSubPix, in windows that reach half way to the next corner, 11 px at
/// most.
std::vector<cv::Point2f> find_corners(const cv::Mat& grey, const Board& board);

/// Brings the corners of the right image into the order of the left one's: two cameras side by side see the board from
/// the same side.
void order_like(const std::vector<cv::Point2f>& left, std::vector<cv::Point2f>& right);

}  // namespace takt::calibration
