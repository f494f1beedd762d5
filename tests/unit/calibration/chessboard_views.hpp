// SPDX-License-Identifier: Apache-2.0
// Pictures of a chessboard by cameras that are known: each pixel is the mean of 3 x 3 rays, followed through the lens
// to the board.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <random>
#include <string>
#include <vector>

#include "nodes/calibration/calibrate.hpp"
#include "nodes/calibration/image_pairs.hpp"

namespace takt::test {

/// From the board (x along rows, y along columns, z = 0) into a camera: p_camera = rotation p_board + translation.
struct BoardPose {
  cv::Matx33d rotation = cv::Matx33d::eye();
  cv::Vec3d translation;
};

/// A pinhole camera with the distortion k1 k2 p1 p2 k3.
class ChessboardCamera {
 public:
  ChessboardCamera(const std::array<double, 9>& matrix, const std::array<double, 5>& distortion, int width, int height)
      : width_(width), height_(height) {
    for (int y = 0; y < kFine * height; ++y)
      for (int x = 0; x < kFine * width; ++x)
        rays_.push_back(ray(matrix, distortion, (x + 0.5) / kFine - 0.5, (y + 0.5) / kFine - 0.5));
  }

  cv::Mat render(const calibration::Board& board, const BoardPose& pose, double noise, uint32_t seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> sensor(0, noise);
    const double* to_board = pose.rotation.val;  // read by columns: the transpose
    const auto component = [&](int i, double x, double y, double z) {
      return to_board[i] * x + to_board[3 + i] * y + to_board[6 + i] * z;
    };
    const cv::Vec3d eye = pose.rotation.t() * pose.translation;
    cv::Mat sums(height_, width_, CV_32F, cv::Scalar(0));
    const Ray* ray = rays_.data();
    for (int y = 0; y < kFine * height_; ++y)
      for (int x = 0; x < kFine * width_; ++x, ++ray) {
        const double depth = eye[2] / component(2, ray->x, ray->y, 1);
        sums.ptr<float>(y / kFine)[x / kFine] += static_cast<float>(brightness(
            board, depth * component(0, ray->x, ray->y, 1) - eye[0], depth * component(1, ray->x, ray->y, 1) - eye[1]));
      }
    cv::Mat image(height_, width_, CV_8U);
    for (int i = 0; i < width_ * height_; ++i)
      image.data[i] = cv::saturate_cast<uint8_t>(sums.ptr<float>()[i] / (kFine * kFine) + sensor(random));
    return image;
  }

 private:
  static constexpr int kFine = 3;  // rays along each side of a pixel

  /// Where it meets the plane one unit before the camera.
  struct Ray {
    double x, y;
  };

  static Ray ray(const std::array<double, 9>& m, const std::array<double, 5>& d, double u, double v) {
    const double xd = (u - m[2]) / m[0], yd = (v - m[5]) / m[4];
    double x = xd, y = yd;
    for (int i = 0; i < 20; ++i) {
      const double r2 = x * x + y * y, radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
      const double dx = 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x), dy = d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y;
      x = (xd - dx) / radial;
      y = (yd - dy) / radial;
    }
    return {x, y};
  }

  /// Inner corner (0, 0) is the origin; a white border of one square stands around the board.
  static double brightness(const calibration::Board& board, double x, double y) {
    const int column = static_cast<int>(std::floor(x / board.square)),
              row = static_cast<int>(std::floor(y / board.square));
    if (column < -2 || row < -2 || column > board.columns || row > board.rows) return 110;
    if (column < -1 || row < -1 || column == board.columns || row == board.rows) return 225;
    return (column + row) % 2 == 0 ? 30 : 225;
  }

  int width_, height_;
  std::vector<Ray> rays_;
};

/// A stereo camera as it might be, and a person who holds a board before it.
struct ChessboardScene {
  stereo::StereoCalibration truth;
  calibration::Board board{9, 6, 0.022};

  ChessboardScene() {
    truth.width = 480;
    truth.height = 360;
    truth.left_matrix = {402, 0, 243.5, 0, 400.5, 176.2, 0, 0, 1};
    truth.right_matrix = {397, 0, 236.8, 0, 398.2, 183.4, 0, 0, 1};
    truth.left_distortion = {-0.21, 0.08, 0.0008, -0.0006, 0};
    truth.right_distortion = {-0.19, 0.06, -0.0005, 0.0009, 0};
    cv::Matx33d rotation;
    cv::Rodrigues(cv::Vec3d(0.012, -0.02, 0.008), rotation);
    std::copy_n(rotation.val, 9, truth.rotation.begin());
    truth.translation_m = {-0.11, 0.002, -0.003};
  }

  /// The board before the left camera, tilted and moved differently in each view.
  BoardPose pose(int view) const {
    const double a = 2.4 * view;  // the golden angle: no two views alike
    cv::Matx33d rotation;
    cv::Rodrigues(cv::Vec3d(0.45 * std::sin(a), 0.5 * std::cos(a), 0.25 * std::sin(2.1 * a)), rotation);
    const double distance = 0.42 + 0.03 * (view % 5);
    const cv::Vec3d centre(0.06 * std::cos(a + 1) + 0.055, 0.06 * std::sin(a + 1), distance);
    const cv::Vec3d middle((board.columns - 1) * board.square / 2, (board.rows - 1) * board.square / 2, 0);
    return {rotation, centre - rotation * middle};
  }
  /// The same board before the right camera.
  BoardPose in_right(const BoardPose& left) const {
    const cv::Matx33d rotation(truth.rotation.data());
    return {rotation * left.rotation, rotation * left.translation + cv::Vec3d(truth.translation_m.data())};
  }

  /// `moved`: a view in which the board went on by 4 mm between the two exposures; -1: none.
  std::vector<calibration::GreyPair> render(int views, int moved = -1) const {
    const ChessboardCamera left(truth.left_matrix, truth.left_distortion, truth.width, truth.height),
        right(truth.right_matrix, truth.right_distortion, truth.width, truth.height);
    std::vector<calibration::GreyPair> pairs;
    for (int view = 0; view < views; ++view) {
      BoardPose at = pose(view);
      cv::Mat image = left.render(board, at, 2, static_cast<uint32_t>(2 * view));
      if (view == moved) at.translation[1] += 0.004;
      pairs.push_back({image, right.render(board, in_right(at), 2, static_cast<uint32_t>(2 * view + 1))});
    }
    return pairs;
  }
};

/// Corners of all pairs; each must show the whole board.
inline std::vector<calibration::View> views_of(const std::vector<calibration::GreyPair>& pairs,
                                               const calibration::Board& board) {
  std::vector<calibration::View> views;
  for (const calibration::GreyPair& pair : pairs) {
    views.push_back({std::to_string(views.size()), calibration::find_corners(pair.left, board),
                     calibration::find_corners(pair.right, board)});
    if (!views.back().left.empty() && !views.back().right.empty())
      calibration::order_like(views.back().left, views.back().right);
  }
  return views;
}

}  // namespace takt::test
