// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "nodes/cloud/cloud.hpp"

namespace takt::picture {

/// A row of views of coloured clouds, as one BGR image: each cloud from above (x to the right, y up) and from the side
/// (x, z) below it, all to the same scale, which the quantiles of the first cloud set.
cv::Mat draw_clouds(std::span<const cloud::CloudView> clouds);

}  // namespace takt::picture
