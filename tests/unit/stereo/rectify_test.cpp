// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/rectify.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/quaternion.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/remap_reference.hpp"
#include "rt/file/output_file.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

/// Two cameras that differ a little, a few degrees apart.
StereoCalibration crooked_pair() {
  StereoCalibration c;
  c.width = 320;
  c.height = 240;
  c.left_matrix = {250, 0, 158, 0, 251, 121, 0, 0, 1};
  c.right_matrix = {253, 0, 163, 0, 252, 117, 0, 0, 1};
  c.left_distortion = {-0.2, 0.05, 0.001, -0.001, 0};
  c.right_distortion = {-0.18, 0.04, -0.001, 0.002, 0};
  const double a = 0.03, b = -0.02;
  c.rotation = {std::cos(a),
                0,
                std::sin(a),
                std::sin(a) * std::sin(b),
                std::cos(b),
                -std::cos(a) * std::sin(b),
                -std::sin(a) * std::cos(b),
                std::sin(b),
                std::cos(a) * std::cos(b)};
  c.translation_m = {-0.12, 0.003, 0.002};
  return c;
}

cv::Point2d project(const std::array<double, 9>& k, const std::array<double, 5>& d, const cv::Vec3d& p) {
  std::vector<cv::Point2d> out;
  cv::projectPoints(std::vector<cv::Point3d>{{p[0], p[1], p[2]}}, cv::Vec3d(), cv::Vec3d(),
                    cv::Mat(3, 3, CV_64F, const_cast<double*>(k.data())),
                    cv::Mat(1, 5, CV_64F, const_cast<double*>(d.data())), out);
  return out[0];
}

/// Centre of the one bright spot of an image.
cv::Point2d centre(const std::vector<uint8_t>& image, int width) {
  double sum = 0, x = 0, y = 0;
  for (size_t i = 0; i < image.size(); ++i) {
    sum += image[i];
    x += image[i] * static_cast<double>(i % static_cast<size_t>(width));
    y += image[i] * static_cast<double>(i / static_cast<size_t>(width));
  }
  return {x / sum, y / sum};
}

std::vector<uint8_t> spot(int width, int height, cv::Point2d at) {
  std::vector<uint8_t> image(static_cast<size_t>(width * height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image[static_cast<size_t>(y * width + x)] =
          static_cast<uint8_t>(std::lround(250 * std::exp(-(std::pow(x - at.x, 2) + std::pow(y - at.y, 2)) / 8)));
  return image;
}

}  // namespace

TEST_CASE("a point in space lies on one row of both rectified images, at the disparity of its depth") {
  const StereoCalibration c = crooked_pair();
  Rectifier rectifier(c);
  CHECK(rectifier.camera().baseline_m == doctest::Approx(std::sqrt(0.12 * 0.12 + 0.003 * 0.003 + 0.002 * 0.002)));
  for (const cv::Vec3d& p : {cv::Vec3d{0, 0, 2}, cv::Vec3d{0.4, -0.3, 1.5}, cv::Vec3d{-0.5, 0.6, 3}}) {
    const cv::Matx33d rotation(c.rotation.data());
    const cv::Vec3d in_right = rotation * p + cv::Vec3d(c.translation_m.data());
    const auto left = spot(c.width, c.height, project(c.left_matrix, c.left_distortion, p));
    const auto right = spot(c.width, c.height, project(c.right_matrix, c.right_distortion, in_right));
    std::vector<uint8_t> l(left.size()), r(right.size());
    REQUIRE(rectifier.rectify({left.data(), c.width, c.height}, {right.data(), c.width, c.height},
                              {l.data(), c.width, c.height}, {r.data(), c.width, c.height}));
    const auto a = centre(l, c.width), b = centre(r, c.width);
    CHECK(std::abs(a.y - b.y) < 0.15);
    const double depth = rectifier.camera().focal_px * rectifier.camera().baseline_m / (a.x - b.x);
    // The point in the rectified frame, as the turn of that frame has it.
    const Transform& t = rectifier.rectified_in_raw();
    const cv::Vec3d turned = cv::Quatd(t.qw, -t.qx, -t.qy, -t.qz).toRotMat3x3() * p;
    const CameraModel& camera = rectifier.camera();
    CHECK(depth == doctest::Approx(turned[2]).epsilon(0.02));
    CHECK(std::abs(a.x - (camera.focal_px * turned[0] / turned[2] + camera.cu_px)) < 0.15);
    CHECK(std::abs(a.y - (camera.focal_px * turned[1] / turned[2] + camera.cv_px)) < 0.15);
  }
}

TEST_CASE("the remap agrees with OpenCV's within two grey levels, one and three channels") {
  const StereoCalibration c = crooked_pair();
  Rectifier rectifier(c);
  cv::Mat r1, r2, p1, p2, q, x, y;
  cv::Mat k1(3, 3, CV_64F, const_cast<double*>(c.left_matrix.data())),
      k2(3, 3, CV_64F, const_cast<double*>(c.right_matrix.data()));
  cv::Mat d1(1, 5, CV_64F, const_cast<double*>(c.left_distortion.data())),
      d2(1, 5, CV_64F, const_cast<double*>(c.right_distortion.data()));
  cv::stereoRectify(k1, d1, k2, d2, {c.width, c.height}, cv::Mat(3, 3, CV_64F, const_cast<double*>(c.rotation.data())),
                    cv::Mat(3, 1, CV_64F, const_cast<double*>(c.translation_m.data())), r1, r2, p1, p2, q,
                    cv::CALIB_ZERO_DISPARITY, 0);
  cv::initUndistortRectifyMap(k1, d1, r1, p1, {c.width, c.height}, CV_32F, x, y);
  for (const int channels : {1, 3}) {
    cv::Mat in(c.height, c.width, CV_8UC(channels)), expected;
    cv::theRNG().state = 5;
    cv::randu(in, 0, 256);
    cv::GaussianBlur(in, in, {0, 0}, 2);  // OpenCV rounds positions to 1/32 px; smooth images forgive that
    cv::remap(in, expected, x, y, cv::INTER_LINEAR);
    cv::Mat left(in.size(), in.type()), right(in.size(), in.type());
    REQUIRE(rectifier.rectify({in.data, c.width, c.height, channels}, {in.data, c.width, c.height, channels},
                              {left.data, c.width, c.height, channels}, {right.data, c.width, c.height, channels}));
    cv::Mat inner = (x >= 1) & (y >= 1) & (x < c.width - 2) & (y < c.height - 2);
    CHECK(cv::countNonZero(inner) > c.width * c.height / 2);
    cv::Mat difference;
    cv::absdiff(left, expected, difference);
    difference.setTo(cv::Scalar::all(0), inner == 0);
    CHECK(cv::norm(difference, cv::NORM_INF) <= 2);
    CHECK(cv::norm(left, cv::NORM_L1) > 0);
  }
}

TEST_CASE("the debayering is OpenCV's, but for the outermost pixels") {
  // OpenCV names a filter by its second row and column.
  const std::pair<BayerPattern, int> patterns[] = {{BayerPattern::rggb, cv::COLOR_BayerBG2BGR},
                                                   {BayerPattern::bggr, cv::COLOR_BayerRG2BGR},
                                                   {BayerPattern::grbg, cv::COLOR_BayerGB2BGR},
                                                   {BayerPattern::gbrg, cv::COLOR_BayerGR2BGR}};
  cv::Mat mosaic(38, 71, CV_8U), theirs;
  cv::theRNG().state = 6;
  cv::randu(mosaic, 0, 256);
  for (const auto& [pattern, code] : patterns) {
    cv::cvtColor(mosaic, theirs, code);
    cv::Mat ours(mosaic.size(), CV_8UC3);
    reference::debayer({mosaic.data, 71, 38}, pattern, {ours.data, 71, 38, 3});
    const cv::Rect inner(1, 1, 69, 36);
    CHECK(cv::norm(ours(inner), theirs(inner), cv::NORM_INF) == 0);
  }
}

TEST_CASE("a mosaic gives what its debayered image gives") {
  const StereoCalibration c = crooked_pair();
  cv::Mat mosaic(c.height, c.width, CV_8U), colour(mosaic.size(), CV_8UC3);
  cv::theRNG().state = 7;
  cv::randu(mosaic, 0, 256);
  reference::debayer({mosaic.data, c.width, c.height}, BayerPattern::grbg, {colour.data, c.width, c.height, 3});
  Rectifier from_colour(c), from_mosaic(c, BayerPattern::grbg);
  cv::Mat out[4];
  for (cv::Mat& m : out) m.create(mosaic.size(), CV_8UC3);
  const auto view = [](cv::Mat& m) { return ImageView<uint8_t>{m.data, m.cols, m.rows, m.channels()}; };
  REQUIRE(from_colour.rectify(view(colour), view(colour), view(out[0]), view(out[1])));
  REQUIRE(from_mosaic.rectify(view(mosaic), view(mosaic), view(out[2]), view(out[3])));
  CHECK(cv::norm(out[0], out[2], cv::NORM_INF) == 0);
  CHECK(cv::norm(out[1], out[3], cv::NORM_INF) == 0);
  CHECK_FALSE(from_mosaic.rectify(view(colour), view(colour), view(out[2]), view(out[3])));
  CHECK_FALSE(from_mosaic.rectify(view(mosaic), view(mosaic), view(mosaic), view(mosaic)));
}

TEST_CASE("a calibration that was written is read again, by OpenCV as well") {
  const StereoCalibration c = crooked_pair();
  const takt::test::TemporaryFolder temporary;
  const auto path = temporary.path / "rig.yaml";
  write_calibration(path, c, "made by a test");
  const StereoCalibration again = read_calibration(path);
  CHECK(again.width == c.width);
  CHECK(again.height == c.height);
  CHECK(again.left_matrix == c.left_matrix);
  CHECK(again.right_distortion == c.right_distortion);
  CHECK(again.rotation == c.rotation);
  CHECK(again.translation_m == c.translation_m);
  CHECK(read_intrinsics(path).right_matrix == c.right_matrix);
  const cv::FileStorage file(path.string(), cv::FileStorage::READ);
  cv::Mat r, t;
  file["R"] >> r, file["T"] >> t;
  CHECK(r.size() == cv::Size(3, 3));
  CHECK(t.size() == cv::Size(1, 3));
  CHECK_THROWS_AS(write_calibration(temporary.path / "none" / "rig.yaml", c, ""), OutputError);
  CHECK_THROWS_AS(write_calibration(temporary.path / "rig.json", c, ""), std::invalid_argument);
}

TEST_CASE("a rectified pair passes through unchanged") {
  Rectifier rectifier(5, 2, {100, 2, 1, 0.1});
  const std::vector<uint8_t> left{1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, right{9, 8, 7, 6, 5, 4, 3, 2, 1, 0};
  std::vector<uint8_t> l(10), r(10);
  REQUIRE(rectifier.rectify({left.data(), 5, 2}, {right.data(), 5, 2}, {l.data(), 5, 2}, {r.data(), 5, 2}));
  CHECK(l == left);
  CHECK(r == right);
  CHECK_FALSE(rectifier.rectify({left.data(), 5, 1}, {right.data(), 5, 2}, {l.data(), 5, 2}, {r.data(), 5, 2}));
}

TEST_CASE("calibrations that cannot be used are refused with name and value") {
  const auto message = [](auto change) {
    StereoCalibration c = crooked_pair();
    change(c);
    try {
      Rectifier rectifier(c);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  CHECK(message([](auto&) {}) == "accepted");
  CHECK(message([&](auto& c) { c.left_matrix[2] = nan; }).find("left_matrix[2] is nan") != std::string::npos);
  CHECK(message([&](auto& c) { c.right_distortion[4] = infinite; }).find("right_distortion[4] is inf") !=
        std::string::npos);
  CHECK(message([&](auto& c) { c.translation_m[0] = -infinite; }).find("translation_m[0]") != std::string::npos);
  CHECK(message([](auto& c) { c.right_matrix[0] = 0; }).find("focal") != std::string::npos);
  CHECK(message([](auto& c) { c.rotation[0] = 0.5; }).find("orthonormal") != std::string::npos);
  CHECK(message([](auto& c) { c.translation_m = {0.12, 0, 0}; }).find("to the right") != std::string::npos);
  CHECK(message([](auto& c) { c.translation_m = {0, -0.12, 0}; }).find("to the right") != std::string::npos);
  CHECK(message([](auto& c) { c.width = 4; }).find("4 x 240") != std::string::npos);
  CHECK_THROWS_AS(read_calibration("no_such_file.yaml"), std::invalid_argument);
}
