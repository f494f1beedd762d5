// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/recorded/recording.hpp"
#include "tests/unit/stereo/moved_pairs.hpp"

using namespace takt::test;

TEST_CASE("recorded pairs whose rows differ by more than a pixel are told as wrong, however much they differ") {
  struct Recording {
    const char *folder, *left, *right;
    int disparities;
    double size;
  };
  for (const Recording& r : {Recording{"stereo/tsukuba", "im3.png", "im4.png", 16, 1},
                             Recording{"stereo/teddy", "im2.png", "im6.png", 64, 1},
                             Recording{"stereo/aloe", "aloeL.jpg", "aloeR.jpg", 112, 0.5}}) {
    const auto folder = recording(r.folder);
    NamedPair scene{r.folder, cv::imread((folder / r.left).string()), cv::imread((folder / r.right).string()),
                    r.disparities};
    for (cv::Mat* image : {&scene.left, &scene.right})
      cv::resize(*image, *image, {}, r.size, r.size, r.size < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
    expect_told(scene);
  }
}
