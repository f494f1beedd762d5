// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/chessboard.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace takt::calibration {
namespace {

/// Shortest distance of two neighbours along rows and columns, px.
double spacing(const std::vector<cv::Point2f>& corners, const Board& board) {
  double least = HUGE_VAL;
  const auto columns = static_cast<size_t>(board.columns);
  for (size_t i = 0; i < corners.size(); ++i) {
    if ((i + 1) % columns != 0) least = std::min(least, cv::norm(corners[i + 1] - corners[i]));
    if (i + columns < corners.size()) least = std::min(least, cv::norm(corners[i + columns] - corners[i]));
  }
  return least;
}

}  // namespace

std::vector<cv::Point3f> board_points(const Board& board) {
  std::vector<cv::Point3f> points;
  for (int row = 0; row < board.rows; ++row)
    for (int column = 0; column < board.columns; ++column)
      points.emplace_back(static_cast<float>(column * board.square), static_cast<float>(row * board.square), 0.0f);
  return points;
}

std::vector<cv::Point2f> find_corners(const cv::Mat& grey, const Board& board) {
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(grey, {board.columns, board.rows}, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return {};
  const int reach = std::clamp(static_cast<int>(spacing(corners, board) / 2) - 1, 2, 11);
  cv::cornerSubPix(grey, corners, {reach, reach}, {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 0.001});
  return corners;
}

void order_like(const std::vector<cv::Point2f>& left, std::vector<cv::Point2f>& right) {
  if ((left.back() - left.front()).dot(right.back() - right.front()) < 0) std::reverse(right.begin(), right.end());
}

}  // namespace takt::calibration
