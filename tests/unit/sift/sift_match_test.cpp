// SPDX-License-Identifier: Apache-2.0
#include "nodes/sift/sift_match.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>

using namespace takt::sift;

namespace {

/// Blurred noise: as many keypoints as one could wish.
cv::Mat texture(int width, int height, uint64_t seed) {
  cv::Mat image(height, width, CV_8UC1);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(image, image, {0, 0}, 2);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

}  // namespace

TEST_CASE("SIFT finds a reference that was turned, made smaller and put into another image, and not one that was not") {
  const cv::Mat reference = texture(160, 120, 1), other = texture(160, 120, 2);
  cv::Mat scene = texture(640, 480, 3);
  const cv::Mat pose = cv::getRotationMatrix2D({80, 60}, 30, 0.8) + cv::Mat_<double>({2, 3}, {0, 0, 200, 0, 0, 150});
  cv::warpAffine(reference, scene, pose, scene.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  Matcher matcher;
  const Features in_scene = matcher.features(scene);
  const Match found = matcher.match(matcher.features(reference), in_scene);
  CHECK(found.found);
  CHECK(found.matches >= found.inliers);
  CHECK(found.inliers >= 8);
  CHECK_FALSE(matcher.match(matcher.features(other), in_scene).found);
}

TEST_CASE("SIFT decides for nothing where there is too little to match") {
  Matcher matcher;
  const Features flat = matcher.features(cv::Mat(100, 100, CV_8UC1, cv::Scalar(90)));
  CHECK(flat.keypoints.empty());
  const Features rich = matcher.features(texture(160, 120, 1));
  CHECK_FALSE(matcher.match(flat, rich).found);
  CHECK_FALSE(matcher.match(rich, flat).found);
  CHECK(Matcher({.inliers_min = 100'000}).match(rich, rich).matches > 8);
  CHECK_FALSE(Matcher({.inliers_min = 100'000}).match(rich, rich).found);
}
