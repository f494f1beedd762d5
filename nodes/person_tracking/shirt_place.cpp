// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/shirt_place.hpp"

#include <algorithm>
#include <cmath>

namespace takt::person_tracking {
namespace {

using Eigen::Matrix2d, Eigen::Vector2d;

constexpr size_t kFewest = 4;                     // corners with a disparity that give a range
constexpr double kMiddle_px = 4;                  // uncertainty of a box's middle
constexpr int kFractions = 64, kNoFraction = 32;  // as DisparityMap has them

mapping_3d::Position in_robot(const Board& board, double z_m, const Viewpoint& view) {
  const CameraModel& c = view.camera;
  const double x = board.box.x + 0.5 * board.box.width - c.cu_px, y = board.box.y + 0.5 * board.box.height - c.cv_px;
  return mapping_3d::transformed(view.camera_in_robot, x * z_m / c.focal_px, y * z_m / c.focal_px, z_m);
}

/// Disparities at the corners of a board.
struct CornerDisparities {
  size_t known = 0, agreeing = 0;
  double median = 0;  ///< of those that agree
};

CornerDisparities at_corners(const Board& board, const Disparities& disparities, double low, double high) {
  std::array<float, Board::kMostPlaces> values;
  CornerDisparities out;
  const size_t count = std::min(Board::kMostPlaces, static_cast<size_t>(board.corners));
  for (size_t i = 0; i < count; ++i) {
    const int x = static_cast<int>(board.places[i].x + 0.5f), y = static_cast<int>(board.places[i].y + 0.5f);
    if (!disparities.whole.contains(x, y) || disparities.whole.at(x, y) <= 0) continue;
    ++out.known;
    double d = disparities.whole.at(x, y);
    if (disparities.fraction.data != nullptr)
      d += static_cast<double>(disparities.fraction.at(x, y) - kNoFraction) / kFractions;
    if (d >= low && d <= high) values[out.agreeing++] = static_cast<float>(d);
  }
  if (out.agreeing == 0) return out;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(out.agreeing / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<ptrdiff_t>(out.agreeing));
  out.median = *middle;
  return out;
}

}  // namespace

BoardRange measure_range(const Board& board, const Disparities& disparities, const CameraModel& camera,
                         const ShirtParameters& p) {
  const double by_size = camera.focal_px * p.square_m / board.square_px;
  BoardRange range{by_size, by_size * p.size_sigma};
  if (disparities.whole.data == nullptr || !(camera.baseline_m > 0)) return range;
  const double focal_baseline = camera.focal_px * camera.baseline_m, expected = focal_baseline / by_size;
  const auto seen = at_corners(board, disparities, expected / (1 + p.agree), expected * (1 + p.agree));
  range.sure = false;
  if (3 * seen.agreeing < seen.known || seen.agreeing < kFewest) return range;
  range.z_m = focal_baseline / seen.median;
  range.sigma_m = range.z_m * p.disparity_sigma_px / seen.median;
  range.by_disparity = range.sure = true;
  return range;
}

double height_of(const Board& board, double z_m, const Viewpoint& view) { return in_robot(board, z_m, view).z_m; }

std::optional<Place> place_of(const Board& board, const BoardRange& range, const Viewpoint& view,
                              const ShirtParameters& p) {
  const mapping_3d::Position robot = in_robot(board, range.z_m, view);
  if (range.z_m > p.range_max_m || robot.z_m < p.height_min_m || robot.z_m > p.height_max_m) return std::nullopt;
  const mapping_3d::Position shirt = mapping_3d::transformed(view.robot_in_world, robot.x_m, robot.y_m, 0);
  const mapping_3d::Position eye =
      mapping_3d::transformed(view.robot_in_world, view.camera_in_robot.t[0], view.camera_in_robot.t[1], 0);
  const Vector2d along = (Vector2d(shirt.x_m, shirt.y_m) - Vector2d(eye.x_m, eye.y_m)).normalized();
  const Vector2d across(-along.y(), along.x());
  const double beside = std::hypot(p.beside_sigma_m, range.z_m * kMiddle_px / view.camera.focal_px);
  Place place;
  place.sure = range.sure;
  place.at = Vector2d(shirt.x_m, shirt.y_m) + p.behind_m * along;
  place.covariance =
      range.sigma_m * range.sigma_m * along * along.transpose() + beside * beside * across * across.transpose();
  return place;
}

std::optional<ExpectedBoard> expected_board(const Vector2d& person, double height_m, double wide, double high,
                                            const Viewpoint& view, const ShirtParameters& p) {
  const auto back = [](const mapping_3d::Affine& a, const Eigen::Vector3d& v) -> Eigen::Vector3d {
    const Eigen::Matrix3d r = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(a.r);
    return r.transpose() * (v - Eigen::Vector3d(a.t[0], a.t[1], a.t[2]));
  };
  const Eigen::Vector3d robot = back(view.robot_in_world, {person.x(), person.y(), 0});
  const Eigen::Vector3d seen = back(view.camera_in_robot, {robot.x(), robot.y(), height_m});
  const double z = seen.z() - p.behind_m;
  if (z < 0.2) return std::nullopt;
  const CameraModel& c = view.camera;
  const double square = c.focal_px * p.square_m / z;
  return ExpectedBoard{c.cu_px + c.focal_px * seen.x() / z, c.cv_px + c.focal_px * seen.y() / z, wide * square,
                       high * square, square};
}

}  // namespace takt::person_tracking
