// SPDX-License-Identifier: Apache-2.0
// The monitor behind the matcher, as in the node, on a made pair whose right image was moved up or down.
#include <doctest/doctest.h>

#include <vector>

#include "nodes/stereo/generated_pair.hpp"
#include "tests/unit/stereo/moved_pairs.hpp"

using namespace takt;
using namespace takt::stereo;

TEST_CASE("a made pair whose rows differ by more than a pixel is told as wrong, however much they differ") {
  const GeneratedPair pair = generate_pair(640, 480, 64, 25, 2, 3);
  const auto image = [&](const std::vector<uint8_t>& pixels) {
    return cv::Mat(pair.height, pair.width, CV_8UC3, const_cast<uint8_t*>(pixels.data()));
  };
  test::expect_told({"made", image(pair.left), image(pair.right), 64});
}
