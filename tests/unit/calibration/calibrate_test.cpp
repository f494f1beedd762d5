// SPDX-License-Identifier: Apache-2.0
// Cameras that are known take pictures of a board; what is found must be these cameras.
#include "nodes/calibration/calibrate.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "nodes/calibration/epipolar.hpp"
#include "nodes/calibration/picture.hpp"
#include "tests/unit/calibration/chessboard_views.hpp"

using namespace takt;
using namespace takt::calibration;
using takt::test::ChessboardScene;

namespace {

constexpr int kViews = 14, kMoved = 5;

/// Rendered once: it takes longer than all the rest.
const std::vector<GreyPair>& pictures() {
  static const std::vector<GreyPair> pairs = ChessboardScene().render(kViews, kMoved);
  return pairs;
}

void check_camera(const std::array<double, 9>& m, const std::array<double, 5>& d, const std::array<double, 9>& true_m,
                  const std::array<double, 5>& true_d) {
  CHECK(std::abs(m[0] - true_m[0]) < 0.005 * true_m[0]);
  CHECK(std::abs(m[4] - true_m[4]) < 0.005 * true_m[4]);
  CHECK(std::abs(m[2] - true_m[2]) < 2);
  CHECK(std::abs(m[5] - true_m[5]) < 2);
  CHECK(std::abs(d[0] - true_d[0]) < 0.02);
}

double degrees_between(const std::array<double, 9>& a, const std::array<double, 9>& b) {
  cv::Vec3d turn;
  cv::Rodrigues(cv::Matx33d(a.data()) * cv::Matx33d(b.data()).t(), turn);
  return cv::norm(turn) * 180 / CV_PI;
}

}  // namespace

TEST_CASE("the cameras and the pose between them are found; a view with a moving board is rejected by name") {
  const ChessboardScene scene;
  const std::vector<View> views = takt::test::views_of(pictures(), scene.board);
  for (const View& view : views) {
    INFO("view ", view.name);
    REQUIRE(view.left.size() == 54);
    REQUIRE(view.right.size() == 54);
  }
  const CalibrationResult result = calibrate(views, scene.board, {scene.truth.width, scene.truth.height});
  REQUIRE(result.rejected.size() == 1);
  CHECK(views[result.rejected[0].view].name == std::to_string(kMoved));
  CHECK(result.rejected[0].error_px > result.rejected[0].limit_px);
  CHECK(result.used.size() == kViews - 1);
  CHECK(result.fit.view_px.size() == kViews - 1);
  const stereo::StereoCalibration& found = result.fit.cameras;
  check_camera(found.left_matrix, found.left_distortion, scene.truth.left_matrix, scene.truth.left_distortion);
  check_camera(found.right_matrix, found.right_distortion, scene.truth.right_matrix, scene.truth.right_distortion);
  CHECK(degrees_between(found.rotation, scene.truth.rotation) < 0.2);
  const auto length = [](const std::array<double, 3>& t) { return cv::norm(cv::Vec3d(t.data())); };
  CHECK(length(found.translation_m) == doctest::Approx(length(scene.truth.translation_m)).epsilon(0.005));
  CHECK(result.fit.both_px < 0.1);
  CHECK(std::hypot(result.fit.left_px, result.fit.right_px) / std::sqrt(2.0) ==
        doctest::Approx(result.fit.both_px).epsilon(1e-6));
}

TEST_CASE("what was found brings corners onto common rows; a wrong pose does not") {
  const ChessboardScene scene;
  const std::vector<View> views = takt::test::views_of(pictures(), scene.board);
  const CalibrationResult result = calibrate(views, scene.board, {scene.truth.width, scene.truth.height});
  const auto rows_with = [&](const stereo::StereoCalibration& cameras) {
    stereo::Rectifier rectifier(cameras);
    std::vector<RectifiedPair> rectified;
    for (const size_t view : result.used) rectified.push_back(rectify(rectifier, pictures()[view], scene.board));
    return epipolar_error(rectified);
  };
  const auto rows = rows_with(result.fit.cameras), rows_of_truth = rows_with(scene.truth);
  REQUIRE(rows);
  REQUIRE(rows_of_truth);
  CHECK(rows->pairs >= result.used.size() / 2);
  CHECK(rows->median_px < 0.1);
  CHECK(rows->p95_px < 0.3);
  CHECK(rows->median_px <= rows->p95_px);
  CHECK(rows->median_px < 2 * rows_of_truth->median_px);
  stereo::StereoCalibration wrong = result.fit.cameras;
  cv::Matx33d nod;
  cv::Rodrigues(cv::Vec3d(2.0 / wrong.left_matrix[4], 0, 0), nod);  // by two rows
  const cv::Matx33d rotation = nod * cv::Matx33d(wrong.rotation.data());
  std::copy_n(rotation.val, 9, wrong.rotation.begin());
  const auto wrong_rows = rows_with(wrong);
  REQUIRE(wrong_rows);
  CHECK(wrong_rows->median_px == doctest::Approx(2).epsilon(0.2));
}

TEST_CASE("a pose fitted to given cameras is the true one") {
  const ChessboardScene scene;
  std::vector<View> views = takt::test::views_of(pictures(), scene.board);
  views.erase(views.begin() + kMoved);
  const Fit fit = fit_pose(views, scene.board, scene.truth);
  CHECK(fit.cameras.left_matrix == scene.truth.left_matrix);
  CHECK(degrees_between(fit.cameras.rotation, scene.truth.rotation) < 0.02);
  CHECK(fit.both_px < 0.1);
}

TEST_CASE("pairs that do not belong together are rejected, also several of them") {
  const ChessboardScene scene;
  std::vector<View> views = takt::test::views_of(pictures(), scene.board);
  std::swap(views[0].right, views[1].right);
  std::swap(views[8].right, views[9].right);
  const CalibrationResult result = calibrate(views, scene.board, {scene.truth.width, scene.truth.height});
  std::vector<size_t> rejected;
  for (const RejectedView& r : result.rejected) rejected.push_back(r.view);
  std::sort(rejected.begin(), rejected.end());
  CHECK(rejected == std::vector<size_t>{0, 1, kMoved, 8, 9});
  CHECK(result.fit.both_px < 0.1);
}

TEST_CASE("too few views are refused with their number") {
  const ChessboardScene scene;
  std::vector<View> views = takt::test::views_of(pictures(), scene.board);
  views.resize(kLeastViews - 1);
  std::string message;
  try {
    calibrate(views, scene.board, {scene.truth.width, scene.truth.height});
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  CHECK(message.find("4 views") != std::string::npos);
}

TEST_CASE("corners are brought into one order; coverage counts cells") {
  std::vector<cv::Point2f> left{{10, 10}, {20, 11}, {30, 12}}, right{{25, 12}, {15, 11}, {5, 10}};
  order_like(left, right);
  CHECK(right.front().x == 5);
  order_like(left, right);
  CHECK(right.front().x == 5);
  const std::vector<std::vector<cv::Point2f>> corners{{{0, 0}, {1, 1}, {79, 0}}, {{79, 59}, {100, 100}}};
  CHECK(coverage(corners, {80, 60}) == doctest::Approx(3.0 / 48));
}

TEST_CASE("the picture has a rectified pair above and both coverages below") {
  const ChessboardScene scene;
  const std::vector<View> views = takt::test::views_of(pictures(), scene.board);
  const CalibrationResult result = calibrate(views, scene.board, {scene.truth.width, scene.truth.height});
  stereo::Rectifier rectifier(result.fit.cameras);
  const cv::Mat picture = draw_calibration(rectify(rectifier, pictures()[0], scene.board), views, result);
  CHECK(picture.rows > 2 * scene.truth.height);
  CHECK(picture.cols > 2 * scene.truth.width);
  // Red dots, of the rejected view, stand below only.
  cv::Mat red;
  cv::inRange(picture, cv::Scalar(50, 50, 225), cv::Scalar(70, 70, 245), red);
  CHECK(cv::countNonZero(red.rowRange(0, scene.truth.height)) == 0);
  CHECK(cv::countNonZero(red.rowRange(scene.truth.height, picture.rows)) > 54);
}
