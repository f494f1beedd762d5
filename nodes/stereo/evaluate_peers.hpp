// SPDX-License-Identifier: Apache-2.0
// OpenCV's matchers beside ours, for comparison only; no node uses them.
#pragma once
#include "nodes/stereo/evaluate.hpp"

namespace takt::stereo {

enum class Peer : uint8_t {
  block_matching,             ///< cv::StereoBM, block 15, as it comes
  block_matching_unfiltered,  ///< the same without its texture and uniqueness filters
  semi_global,  ///< cv::StereoSGBM, 3-way, block 5, P1 = 8 c b^2, P2 = 32 c b^2, preFilterCap 63 as in OpenCV's sample
  semi_global_equal_light  ///< with preFilterCap 0: better where both images are exposed alike, else much worse
};
const char* to_string(Peer peer);

/// Runs a peer on a rectified pair (1 or 3 channels). The images are padded on the left by the search range (rounded up
/// to 16), because OpenCV leaves these columns out. Missing pixels are -1. Throws std::invalid_argument for images that
/// do not fit together. `time_ms`, if given, receives the CPU time of the matching alone.
DisparityImage run_peer(Peer peer, ImageView<const uint8_t> left, ImageView<const uint8_t> right, int disparities,
                        double* time_ms = nullptr);

}  // namespace takt::stereo
