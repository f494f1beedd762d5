// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdio>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <vector>

#include "nodes/ego_motion/ego_motion.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt::ego_motion;
using takt::CameraModel;
using takt::test::recording;

TEST_CASE("a recorded drive: drift and turn error stay below SIFT + SGBM + PnP (1.0 %, 0.026 deg per frame)") {
  const auto folder = recording("stereo_sequence/kitti06");
  std::vector<Rigid> truth, estimated;
  std::ifstream poses(folder / "poses.txt");
  for (std::string line; std::getline(poses, line);) {
    std::istringstream numbers(line);
    Rigid pose;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) numbers >> pose.R(r, c);
      numbers >> pose.t[r];
    }
    truth.push_back(pose);
  }
  REQUIRE(truth.size() == 35);
  const CameraModel camera{707.0912, 601.8873, 183.1104, 379.8145 / 707.0912};
  const auto matcher = cv::StereoBM::create(128, 15);
  EgoMotion ego;
  for (size_t i = 0; i < truth.size(); ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%06zu.png", i);
    const cv::Mat left = cv::imread((folder / "image_l" / name).string(), cv::IMREAD_GRAYSCALE);
    const cv::Mat right = cv::imread((folder / "image_r" / name).string(), cv::IMREAD_GRAYSCALE);
    REQUIRE(!left.empty());
    cv::Mat fine, disparity(left.size(), CV_16S);
    matcher->compute(left, right, fine);
    for (int y = 0; y < fine.rows; ++y)
      for (int x = 0; x < fine.cols; ++x) {
        const int d = fine.at<int16_t>(y, x);
        disparity.at<int16_t>(y, x) = static_cast<int16_t>(d < 0 ? -1 : (d + 8) / 16);
      }
    if (i == 0) ego.configure(left.cols, left.rows, {});
    const Result r = ego.step({{left.data, left.cols, left.rows},
                               {right.data, left.cols, left.rows},
                               {disparity.ptr<int16_t>(), left.cols, left.rows},
                               camera,
                               static_cast<int64_t>(i) * 100'000'000});
    CHECK(r.valid);
    estimated.push_back(from_transform(r.pose.transform));
  }
  const Quality q = evaluate(estimated, truth);
  MESSAGE("drift " << q.drift_pct << " %, " << q.deg_per_frame << " deg per frame, " << q.metres_per_frame
                   << " m per frame");
  CHECK(q.drift_pct < 1.0);
  CHECK(q.deg_per_frame < 0.026);
}
