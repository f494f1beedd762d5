// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <vector>

#include "nodes/calibration/chessboard.hpp"
#include "nodes/stereo/rectify.hpp"

namespace takt::calibration {

/// Corners of the board that both cameras saw at one time, in the same order.
struct View {
  std::string name;
  std::vector<cv::Point2f> left, right;
};

constexpr size_t kLeastViews = 5;
/// A view is rejected if its error exceeds both: so many medians of all, and what good images reach with cameras fitted
/// together; or one by one, with the pose between them from a single view.
constexpr double kRejectMedians = 3, kRejectAbove_px = 0.3, kRejectApartAbove_px = 2;

/// Cameras fitted to views, and by how much the views contradict them: root mean square distances between the corners
/// as seen and as projected, px.
struct Fit {
  stereo::StereoCalibration cameras;
  double left_px = 0, right_px = 0, both_px = 0;
  std::vector<double> view_px;  ///< of both images of each view
};

struct RejectedView {
  size_t view = 0;
  double error_px = 0, limit_px = 0;
};

struct CalibrationResult {
  Fit fit;
  std::vector<size_t> used;            ///< views, in the order of fit.view_px
  std::vector<RejectedView> rejected;  ///< in the order of rejection, worst first
};

/// Pinhole cameras with the distortion k1 k2 p1 p2 (k3 = 0), and the pose between them. First each camera alone
/// (Zhang's method), which pairs that do not belong together cannot spoil; of the poses that single views have for the
/// right camera beside the left, the one with the smallest median error tells which those are, and they are rejected.
/// Then all together, least squares of the reprojection; the view with the largest error goes if it is above the limit,
/// and all is fitted anew, until none is. kLeastViews stay in any case. Throws std::invalid_argument for less than
/// kLeastViews, or views that determine no camera.
CalibrationResult calibrate(std::span<const View> views, const Board& board, cv::Size image);

/// The pose between the cameras alone, their matrices and distortions being given.
Fit fit_pose(std::span<const View> views, const Board& board, const stereo::StereoCalibration& cameras);

/// Share, 0..1, of the cells of an 8 x 6 grid over the image in which a corner was seen: distortion is known only
/// there.
double coverage(std::span<const std::vector<cv::Point2f>> corners, cv::Size image);

}  // namespace takt::calibration
