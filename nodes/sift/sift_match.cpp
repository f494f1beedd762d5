// SPDX-License-Identifier: Apache-2.0
#include "nodes/sift/sift_match.hpp"

#include <opencv2/calib3d.hpp>

namespace takt::sift {

Features Matcher::features(const cv::Mat& image) {
  Features found;
  sift_->detectAndCompute(image, cv::noArray(), found.keypoints, found.descriptors);
  return found;
}

Match Matcher::match(const Features& reference, const Features& image) const {
  Match result;
  if (reference.keypoints.size() < 2 || image.keypoints.size() < 2) return result;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_L2).knnMatch(reference.descriptors, image.descriptors, nearest, 2);
  std::vector<cv::Point2f> from, to;
  for (const auto& two : nearest) {
    if (two.size() < 2 || two[0].distance >= parameters_.ratio * static_cast<double>(two[1].distance)) continue;
    from.push_back(reference.keypoints[static_cast<size_t>(two[0].queryIdx)].pt);
    to.push_back(image.keypoints[static_cast<size_t>(two[0].trainIdx)].pt);
  }
  result.matches = static_cast<int>(from.size());
  if (result.matches < std::max(4, parameters_.inliers_min)) return result;
  cv::Mat inliers;
  if (cv::findHomography(from, to, cv::RANSAC, parameters_.reprojection_px, inliers).empty()) return result;
  result.inliers = cv::countNonZero(inliers);
  result.found = result.inliers >= parameters_.inliers_min;
  return result;
}

}  // namespace takt::sift
