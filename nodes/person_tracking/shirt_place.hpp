// SPDX-License-Identifier: Apache-2.0
// Where the person in a shirt is: its range from disparities, which must agree with the size of its squares.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/person_tracking/shirt_search.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::person_tracking {

/// How a camera stood when it took an image. The world is the frame of the odometry, or the robot's where none is
/// known.
struct Viewpoint {
  CameraModel camera;
  mapping_3d::Affine camera_in_robot, robot_in_world;
};

/// Disparities of the left image, px; without data: none are known.
struct Disparities {
  ImageView<const int16_t> whole;
  ImageView<const uint8_t> fraction{};  ///< as in DisparityMap; without data: whole pixels only
};

/// A person's place on the floor of the world, and how well it is known.
struct Place {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();              ///< m
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  ///< m^2
  bool sure = true;                                          ///< may begin a track
};

struct ShirtParameters {
  double square_m = 0.06;                         ///< edge of a square
  double height_min_m = 0.6, height_max_m = 1.8;  ///< of the shirt's middle: chequered floors are no shirts
  double range_max_m = 8;
  double disparity_sigma_px = 0.5;  ///< of the median; a shirt that is seen in part has another surface in the middle
  double size_sigma = 0.05;         ///< of a range from the squares' size, relative
  double agree = 0.15;              ///< of two disparities that may be the same, relative
  double beside_sigma_m = 0.06;     ///< of the shirt's middle from the person's, across the line of sight
  double behind_m = 0.10;           ///< from the shirt's surface to the person's middle
};

/// The range of a board, m along the optical axis.
struct BoardRange {
  double z_m = 0, sigma_m = 0;
  bool by_disparity = false;
  bool sure = true;  ///< disparities agree with the size, or none were given: other patterns have another size
};

/// From the size of its squares, s = f square / z; and if a third of the disparities known at its corners agree with
/// that, from their median, which is more exact. The size tells apart what a pattern that repeats every second square
/// leaves open to a matcher.
BoardRange measure_range(const Board& board, const Disparities& disparities, const CameraModel& camera,
                         const ShirtParameters& p);

/// Nothing if it is too far away, or as high or low as no shirt is.
std::optional<Place> place_of(const Board& board, const BoardRange& range, const Viewpoint& view,
                              const ShirtParameters& p);

/// How the shirt of a person there should look: `height_m` above the floor, `wide` and `high` squares large. Nothing if
/// that is behind the camera.
std::optional<ExpectedBoard> expected_board(const Eigen::Vector2d& person, double height_m, double wide, double high,
                                            const Viewpoint& view, const ShirtParameters& p);

/// Height above the floor of the middle of a board at that range.
double height_of(const Board& board, double z_m, const Viewpoint& view);

}  // namespace takt::person_tracking
