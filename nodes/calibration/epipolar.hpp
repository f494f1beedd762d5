// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/calibration/chessboard.hpp"
#include "nodes/calibration/image_pairs.hpp"
#include "nodes/stereo/rectify.hpp"

namespace takt::calibration {

/// A rectified pair and the corners that were found in it anew; empty if the board is not whole in both images.
struct RectifiedPair {
  GreyPair images;
  std::vector<cv::Point2f> left, right;
};

/// Rectifies a pair as the stereo node does, and looks for the board. The images have the rectifier's size.
RectifiedPair rectify(stereo::Rectifier& rectifier, const GreyPair& pair, const Board& board);

/// By how many rows corresponding corners of rectified pairs differ, px.
struct EpipolarError {
  double mean_px = 0, median_px = 0, p95_px = 0;
  size_t pairs = 0;  ///< in which the board is whole after rectification
};

/// Nothing if there is no such pair.
std::optional<EpipolarError> epipolar_error(std::span<const RectifiedPair> pairs);

}  // namespace takt::calibration
