// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "rt/quantile.hpp"

namespace takt::calibration {
namespace {

constexpr int kModel = cv::CALIB_FIX_K3;
const cv::TermCriteria kUntil{cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-7};

/// What OpenCV works on.
struct Observations {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> left, right;

  Observations(std::span<const View> views, const std::vector<size_t>& chosen, const Board& b)
      : board(chosen.size(), board_points(b)) {
    for (const size_t view : chosen) {
      left.push_back(views[view].left);
      right.push_back(views[view].right);
    }
  }
};

struct Camera {
  cv::Mat matrix = cv::Mat::eye(3, 3, CV_64F), distortion = cv::Mat::zeros(1, 5, CV_64F);
};

template <size_t kCount>
void copy(const cv::Mat& from, std::array<double, kCount>& to) {
  if (from.total() != kCount || from.type() != CV_64F || !from.isContinuous())
    throw std::logic_error(fmt::format("{} numbers instead of {} in a calibration", from.total(), kCount));
  std::memcpy(to.data(), from.data, sizeof to);
}

double root_mean_square(const cv::Mat& values) {
  return std::sqrt(values.dot(values) / static_cast<double>(values.total()));
}

/// Fits the pose, and the cameras unless `flags` fix them.
Fit fit(const Observations& seen, Camera left, Camera right, cv::Size image, int flags) {
  cv::Mat rotation, translation, essential, fundamental, errors;
  Fit out;
  out.both_px = cv::stereoCalibrate(seen.board, seen.left, seen.right, left.matrix, left.distortion, right.matrix,
                                    right.distortion, image, rotation, translation, essential, fundamental, errors,
                                    flags, kUntil);
  out.left_px = root_mean_square(errors.col(0));
  out.right_px = root_mean_square(errors.col(1));
  for (int view = 0; view < errors.rows; ++view) out.view_px.push_back(root_mean_square(errors.row(view)));
  stereo::StereoCalibration& c = out.cameras;
  c.width = image.width;
  c.height = image.height;
  copy(left.matrix, c.left_matrix);
  copy(left.distortion, c.left_distortion);
  copy(right.matrix, c.right_matrix);
  copy(right.distortion, c.right_distortion);
  copy(rotation, c.rotation);
  copy(translation, c.translation_m);
  return out;
}

/// One camera by itself, and where it saw the board in each view.
struct Alone {
  Camera camera;
  std::vector<cv::Mat> rotations, translations;

  Alone(const Observations& seen, const std::vector<std::vector<cv::Point2f>>& corners, cv::Size image) {
    cv::calibrateCamera(seen.board, corners, image, camera.matrix, camera.distortion, rotations, translations, kModel,
                        kUntil);
  }
};

Fit fit_all(const Observations& seen, cv::Size image) {
  return fit(seen, Alone(seen, seen.left, image).camera, Alone(seen, seen.right, image).camera, image,
             kModel | cv::CALIB_USE_INTRINSIC_GUESS);
}

/// The pose between the cameras as each view alone has it, tried on all views: by how much it misses the corners of the
/// right images, px. Those of the pose with the smallest median, which up to half of the views cannot spoil.
std::vector<double> errors_of_best_pose(const Observations& seen, cv::Size image) {
  const Alone left(seen, seen.left, image), right(seen, seen.right, image);
  const size_t count = seen.board.size();
  std::vector<double> best;
  for (size_t i = 0; i < count; ++i) {
    // Right from board, after board from left.
    cv::Mat back, origin, rotation, translation;
    cv::Rodrigues(left.rotations[i], back);
    back = back.t();
    origin = -back * left.translations[i];
    cv::Rodrigues(back, back);
    cv::composeRT(back, origin, right.rotations[i], right.translations[i], rotation, translation);
    std::vector<double> errors;
    for (size_t view = 0; view < count; ++view) {
      cv::Mat r, t;
      cv::composeRT(left.rotations[view], left.translations[view], rotation, translation, r, t);
      std::vector<cv::Point2f> projected;
      cv::projectPoints(seen.board[view], r, t, right.camera.matrix, right.camera.distortion, projected);
      errors.push_back(cv::norm(projected, seen.right[view]) / std::sqrt(static_cast<double>(projected.size())));
    }
    if (best.empty() || median(errors) < median(best)) best = std::move(errors);
  }
  return best;
}

/// Takes the view with the largest error out of the result if it is above the limit, and others can be spared.
bool reject_worst(std::vector<double>& errors, double above_px, CalibrationResult& result) {
  const auto worst = std::max_element(errors.begin(), errors.end());
  const double limit = std::max(kRejectMedians * median(errors), above_px);
  if (*worst <= limit || result.used.size() == kLeastViews) return false;
  const auto view = result.used.begin() + (worst - errors.begin());
  result.rejected.push_back({*view, *worst, limit});
  result.used.erase(view);
  errors.erase(worst);
  return true;
}

}  // namespace

CalibrationResult calibrate(std::span<const View> views, const Board& board, cv::Size image) {
  if (views.size() < kLeastViews)
    throw std::invalid_argument(
        fmt::format("{} views with a board are too few; at least {} are needed, 15 or more from all sides are good",
                    views.size(), kLeastViews));
  CalibrationResult result;
  result.used.resize(views.size());
  std::iota(result.used.begin(), result.used.end(), size_t{0});
  try {
    std::vector<double> apart = errors_of_best_pose(Observations(views, result.used, board), image);
    while (reject_worst(apart, kRejectApartAbove_px, result)) continue;
    do result.fit = fit_all(Observations(views, result.used, board), image);
    while (reject_worst(result.fit.view_px, kRejectAbove_px, result));
    return result;
  } catch (const cv::Exception& e) {
    throw std::invalid_argument(
        fmt::format("these views determine no camera ({}); tilt the board differently in each", e.err));
  }
}

Fit fit_pose(std::span<const View> views, const Board& board, const stereo::StereoCalibration& cameras) {
  const auto mat = [](const auto& values, int rows) {
    return cv::Mat(std::vector<double>(values.begin(), values.end()), true).reshape(1, rows);
  };
  std::vector<size_t> all(views.size());
  std::iota(all.begin(), all.end(), size_t{0});
  return fit(Observations(views, all, board), {mat(cameras.left_matrix, 3), mat(cameras.left_distortion, 1)},
             {mat(cameras.right_matrix, 3), mat(cameras.right_distortion, 1)}, {cameras.width, cameras.height},
             cv::CALIB_FIX_INTRINSIC);
}

double coverage(std::span<const std::vector<cv::Point2f>> corners, cv::Size image) {
  constexpr int kColumns = 8, kRows = 6;
  std::array<bool, size_t{kColumns} * kRows> seen{};
  for (const auto& view : corners)
    for (const cv::Point2f& p : view) {
      const int column =
          std::clamp(static_cast<int>(p.x * kColumns / static_cast<float>(image.width)), 0, kColumns - 1);
      const int row = std::clamp(static_cast<int>(p.y * kRows / static_cast<float>(image.height)), 0, kRows - 1);
      seen[static_cast<size_t>(row * kColumns + column)] = true;
    }
  return static_cast<double>(std::count(seen.begin(), seen.end(), true)) / static_cast<double>(seen.size());
}

}  // namespace takt::calibration
