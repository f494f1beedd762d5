// SPDX-License-Identifier: Apache-2.0
// A person in a chessboard T-shirt who walks through a hall, seen by the stereo camera of a robot that follows him,
// with ground truth: light and sensor noise, posts and a second person who come between, chequered things that are no
// shirt.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "nodes/body_pose/ray_casting.hpp"
#include "nodes/person_tracking/shirt_place.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/odometry.hpp"

namespace takt::person_tracking {

/// The camera is the robot's narrow one (graph/rigs/xb3.yaml) with its head at rest.
struct WalkParameters {
  int width = 640, height = 480;
  double focal_px = 492.8, baseline_m = 0.24, tilt_rad = -0.2618;
  double rate_hz = 15;
  double square_m = 0.06;
  double light_min = 0.5, light_max = 1.5;  ///< of a walk
  double noise_sigma = 3;                   ///< grey levels, each channel of each pixel
  double odometry_noise = 0.02;             ///< of each step of the odometry, relative
  double speed_max_m_s = 1.2;
  bool second_person = true, posts = true;
};

/// One instant of a walk. Robot frame: x right, y ahead.
struct WalkFrame {
  int64_t stamp_ns = 0;
  std::vector<uint8_t> left, right;                  ///< BGR, rectified
  Odometry odometry;                                 ///< drifts
  Eigen::Vector2d person = Eigen::Vector2d::Zero();  ///< true place in the robot frame
  double visible = 0;  ///< share of the pixels of his shirt that nothing hides; 0: not in the image
};

class GeneratedWalk {
 public:
  /// Walk number `index` of a seed; equal arguments give equal walks.
  GeneratedWalk(const WalkParameters& parameters, uint64_t seed, uint64_t index);

  /// Computes the next frame. The robot drives as a follower does that knows where the person is.
  const WalkFrame& next();
  CameraModel camera() const;
  Transform camera_in_robot() const;
  double light() const { return light_; }

 private:
  using Vector2d = Eigen::Vector2d;
  using Vector3d = Eigen::Vector3d;
  using Bgr = body_pose::Bgr;
  struct Walker {
    Vector2d at = Vector2d::Zero(), goal = Vector2d::Zero();
    double heading_rad = 0, speed_m_s = 0, pause_s = 0, phase = 0, height_m = 1.75;
    bool chequered = false;
  };
  /// A trunk: an upright elliptical cylinder with a shirt on it.
  struct Trunk {
    Vector3d base;
    double height_m, half_width_m, half_depth_m, yaw_rad;
    bool chequered;
  };
  struct Eye;

  void walk(double dt_s);
  void accompany(double dt_s);
  void drive(double dt_s);
  void dress(const Walker& walker);
  void draw(const Eye& eye, std::vector<uint8_t>& image, bool measure);
  void draw_hall(const Eye& eye);
  void draw_capsule(const Eye& eye, const body_pose::Capsule& capsule);
  void draw_trunk(const Eye& eye, const Trunk& trunk, uint8_t mark);
  void expose(std::vector<uint8_t>& image);
  Bgr hall_colour(const Vector3d& at, int wall) const;
  static double meet(const Vector3d& origin, const Vector3d& ray, const Trunk& trunk);
  Bgr shirt_colour(const Trunk& trunk, const Vector3d& at) const;

  WalkParameters p_;
  body_pose::Lot lot_;
  double light_;
  bool chequered_floor_;
  int64_t frames_ = 0;
  Walker person_, other_;
  double robot_x_ = 0, robot_y_ = 0, robot_theta_ = 0;
  std::vector<body_pose::Capsule> posts_, limbs_;
  std::vector<Trunk> trunks_;
  std::vector<uint8_t> noise_tile_;   ///< texture of the hall
  std::vector<int8_t> sensor_noise_;  ///< drawn once; frames take it from different places
  std::vector<float> depth_;
  std::vector<Bgr> colour_;
  std::vector<uint8_t> mark_;  ///< 1: the shirt is nearest here
  int shirt_pixels_ = 0;
  WalkFrame frame_;
};

}  // namespace takt::person_tracking
