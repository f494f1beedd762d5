// SPDX-License-Identifier: Apache-2.0
// Whether an image shows what a reference image shows, by SIFT: the baseline that the thesis dropped (Sec. 3.4.1;
// For measurements, never in a job: OpenCV allocates.
#pragma once
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

namespace takt::sift {

struct Parameters {
  double ratio = 0.75;         ///< a match is nearer than this times the second nearest; 0..1
  int inliers_min = 8;         ///< matches that one homography must explain
  double reprojection_px = 3;  ///< how well
};

/// Keypoints of one image.
struct Features {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};

struct Match {
  int matches = 0;  ///< that pass the ratio test
  int inliers = 0;  ///< of these, agree with the homography
  bool found = false;
};

class Matcher {
 public:
  explicit Matcher(const Parameters& parameters = {}) : parameters_(parameters) {}
  /// Of an 8-bit image with one or three channels.
  Features features(const cv::Mat& image);
  Match match(const Features& reference, const Features& image) const;

 private:
  Parameters parameters_;
  cv::Ptr<cv::SIFT> sift_ = cv::SIFT::create();
};

}  // namespace takt::sift
