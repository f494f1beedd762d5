// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "nodes/calibration/calibrate.hpp"
#include "nodes/calibration/epipolar.hpp"
#include "nodes/calibration/laser_calibration.hpp"

namespace takt::calibration {

/// What a person judges a calibration by, as one BGR image: above, a rectified pair side by side with rows drawn
/// through it and the corners found; below, where in the left and the right image corners were seen: of views that were
/// used green, of rejected ones red.
cv::Mat draw_calibration(const RectifiedPair& pair, std::span<const View> views, const CalibrationResult& result);

/// The room as the sweeps show it, from above and from the side: laid out with the mounts known beforehand, and with
/// those found, the first sweep white, the others orange, the object green; then how far the others lie from the first,
/// from green (0) to red (2 cm and more; what it has not seen is left out).
cv::Mat draw_calibration(const LaserRecording& recording, std::span<const CalibratedScanner> scanners);

}  // namespace takt::calibration
