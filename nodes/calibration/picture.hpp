// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "nodes/calibration/calibrate.hpp"
#include "nodes/calibration/epipolar.hpp"

namespace takt::calibration {

/// What a person judges a calibration by, as one BGR image: above, a rectified pair side by side with rows drawn
/// through it and the corners found; below, where in the left and the right image corners were seen: of views that were
/// used green, of rejected ones red.
cv::Mat draw_calibration(const RectifiedPair& pair, std::span<const View> views, const CalibrationResult& result);

}  // namespace takt::calibration
