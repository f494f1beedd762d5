// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/rectify.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "nodes/stereo/calibration_file.hpp"
#include "tests/recorded/recording.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt::stereo;
using namespace takt::test;

TEST_CASE("a real calibration file brings chessboard corners onto common rows") {
  const auto folder = recording("calibration/chessboard_stereo");
  // The recording has intrinsics only; the pose between the cameras comes from its own images.
  const cv::FileStorage file((folder / "intrinsics.yml").string(), cv::FileStorage::READ);
  cv::Mat k1, d1, k2, d2, r, t, e, f;
  file["M1"] >> k1, file["D1"] >> d1, file["M2"] >> k2, file["D2"] >> d2;
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> corners[2];
  for (const char* number : {"01", "02", "03", "04", "05", "06", "07", "08", "12", "14"}) {
    std::vector<cv::Point2f> found[2];
    bool both = true;
    for (int side = 0; side < 2; ++side) {
      const cv::Mat image = cv::imread((folder / (std::string(side ? "right" : "left") + number + ".jpg")).string(), 0);
      both = cv::findChessboardCorners(image, {9, 6}, found[side]) && both;
      if (both)
        cv::cornerSubPix(image, found[side], {11, 11}, {-1, -1},
                         {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 30, 0.01});
    }
    if (!both) continue;
    board.emplace_back();
    for (int i = 0; i < 54; ++i) board.back().emplace_back(static_cast<float>(i % 9), static_cast<float>(i / 9), 0.0f);
    for (int side = 0; side < 2; ++side) corners[side].push_back(found[side]);
  }
  REQUIRE(board.size() >= 4);
  const double rms_px = cv::stereoCalibrate(board, corners[0], corners[1], k1, d1, k2, d2, {640, 480}, r, t, e, f,
                                            cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_K3);
  REQUIRE(rms_px < 1.0);
  const TemporaryFolder temporary;
  const auto path = temporary.path / "calibration.yaml";
  {  // as OpenCV's own sample writes it
    cv::FileStorage out(path.string(), cv::FileStorage::WRITE);
    out << "M1" << k1 << "D1" << d1 << "M2" << k2 << "D2" << d2 << "R" << r << "T" << t << "image_size"
        << std::vector<int>{640, 480};
  }
  Rectifier rectifier(read_calibration(path));
  const cv::Mat left = cv::imread((folder / "left01.jpg").string(), 0),
                right = cv::imread((folder / "right01.jpg").string(), 0);
  cv::Mat l(left.size(), CV_8U), rr(right.size(), CV_8U);
  REQUIRE(rectifier.rectify({left.data, 640, 480}, {right.data, 640, 480}, {l.data, 640, 480}, {rr.data, 640, 480}));
  std::vector<cv::Point2f> a, b;
  REQUIRE(cv::findChessboardCorners(l, {9, 6}, a));
  REQUIRE(cv::findChessboardCorners(rr, {9, 6}, b));
  double worst = 0;
  for (size_t i = 0; i < a.size(); ++i) worst = std::max<double>(worst, std::abs(a[i].y - b[i].y));
  CHECK(worst < 1.0);
}
