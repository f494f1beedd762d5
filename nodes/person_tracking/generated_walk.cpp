// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/generated_walk.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/person_tracking/follower.hpp"
#include "rt/msg/velocity_command.hpp"

namespace takt::person_tracking {
namespace {

using body_pose::Capsule, body_pose::kNever;
using Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

constexpr double kHall_m = 12, kCeiling_m = 3.5, kCamera_m = 1.4;
constexpr double kTurn_rad_s = 1.5;  // how fast a walker turns
constexpr int kTile = 512;           // texels of a centimetre
constexpr double kPi = std::numbers::pi;

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * kPi); }

Vector2d heading(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

int texel(double metres) { return static_cast<int>(std::floor(metres * 100)) & (kTile - 1); }

}  // namespace

/// One of the two lenses, in the hall's frame.
struct GeneratedWalk::Eye {
  Vector3d at;
  Matrix3d rotation;  ///< camera axes in the hall
  CameraModel camera;
  Vector3d ray(double x, double y) const {
    return (rotation * Vector3d((x - camera.cu_px) / camera.focal_px, (y - camera.cv_px) / camera.focal_px, 1))
        .normalized();
  }
  /// The pixels that a ball covers; empty if it is not before the camera.
  Region around(const Vector3d& centre, double radius_m) const {
    const Vector3d seen = rotation.transpose() * (centre - at);
    if (seen.z() < radius_m + 0.05) return seen.z() < -radius_m ? Region{} : Region{0, 0, 1 << 14, 1 << 14};
    const double x = camera.cu_px + camera.focal_px * seen.x() / seen.z(),
                 y = camera.cv_px + camera.focal_px * seen.y() / seen.z();
    const double reach = 2 + 1.3 * camera.focal_px * radius_m / (seen.z() - radius_m);
    return {static_cast<int>(x - reach), static_cast<int>(y - reach), static_cast<int>(2 * reach) + 1,
            static_cast<int>(2 * reach) + 1};
  }
};

GeneratedWalk::GeneratedWalk(const WalkParameters& parameters, uint64_t seed, uint64_t index)
    : p_(parameters), lot_(seed, index), light_(lot_.in(p_.light_min, p_.light_max)), chequered_floor_(index % 2 == 1) {
  const auto pixels = static_cast<size_t>(p_.width) * static_cast<size_t>(p_.height);
  depth_.resize(pixels);
  colour_.resize(pixels);
  mark_.resize(pixels);
  // Blotches of some centimetres with grain on them.
  std::vector<double> coarse(64 * 64);
  for (double& v : coarse) v = lot_.in(-40, 40);
  noise_tile_.resize(size_t{kTile} * kTile);
  for (size_t i = 0; i < noise_tile_.size(); ++i)
    noise_tile_[i] = static_cast<uint8_t>(128 + coarse[i / kTile / 8 * 64 + i % kTile / 8] + lot_.in(-25, 25));
  sensor_noise_.resize(1 << 16);
  for (int8_t& v : sensor_noise_)
    v = static_cast<int8_t>(std::clamp(std::lround(p_.noise_sigma * lot_.normal()), -127l, 127l));
  robot_x_ = robot_y_ = 2.5;
  robot_theta_ = lot_.in(0.3, 1.2);
  person_.at = Vector2d(robot_x_, robot_y_) + lot_.in(2.0, 3.5) * heading(robot_theta_ + lot_.in(-0.3, 0.3));
  person_.goal = person_.at + 3 * heading(robot_theta_ + lot_.in(-0.5, 0.5));
  person_.heading_rad = robot_theta_;
  person_.height_m = lot_.in(1.6, 1.9);
  person_.chequered = true;
  other_.phase = lot_.in(0, 2 * kPi);
  other_.height_m = lot_.in(1.6, 1.9);
  frame_.odometry = {robot_x_, robot_y_, robot_theta_, 0, 0};
  for (int i = 0; p_.posts && i < 5; ++i) {
    const Vector3d foot(lot_.in(2, 10), lot_.in(2, 10), 0);
    posts_.push_back({foot, foot + Vector3d(0, 0, kCeiling_m), 0.12, {110, 120, 130}});
  }
}

CameraModel GeneratedWalk::camera() const {
  return {p_.focal_px, (p_.width - 1) / 2.0, (p_.height - 1) / 2.0, p_.baseline_m};
}

Transform GeneratedWalk::camera_in_robot() const {
  return mapping_3d::camera_mount(-p_.baseline_m / 2, 0.15, kCamera_m, 0, p_.tilt_rad);
}

/// From one goal to the next, with pauses; not into the robot.
void GeneratedWalk::walk(double dt_s) {
  Walker& w = person_;
  const Vector2d robot(robot_x_, robot_y_);
  if (w.pause_s > 0) {
    w.pause_s -= dt_s;
    w.speed_m_s = std::max(0.0, w.speed_m_s - 2 * dt_s);
  } else if ((w.goal - w.at).norm() < 0.4 || (w.at - robot).norm() < 0.9) {
    const Vector2d away = (w.at - robot).normalized();
    for (int i = 0; i < 100; ++i) {
      w.goal = {lot_.in(1.2, kHall_m - 1.2), lot_.in(1.2, kHall_m - 1.2)};
      const Vector2d way = w.goal - w.at;
      if (way.norm() > 1.5 && way.normalized().dot(away) > -0.2) break;
    }
    if (lot_.chance(0.25)) w.pause_s = lot_.in(0.5, 2);
  } else {
    w.speed_m_s = std::min(p_.speed_max_m_s, w.speed_m_s + dt_s);
  }
  const Vector2d way = w.goal - w.at;
  const double off = wrapped(std::atan2(way.y(), way.x()) - w.heading_rad);
  w.heading_rad += std::clamp(off, -kTurn_rad_s * dt_s, kTurn_rad_s * dt_s);
  const double step = w.speed_m_s * dt_s * std::max(0.2, std::cos(off));
  w.at += step * heading(w.heading_rad);
  w.phase += 2 * kPi * step / 1.4;
}

/// The second person goes round the first, so that he comes between him and the robot.
void GeneratedWalk::accompany(double dt_s) {
  const Vector2d before = other_.at;
  other_.phase += 0.7 * dt_s;
  other_.at = person_.at + 0.9 * heading(other_.phase);
  other_.heading_rad = std::atan2(other_.at.y() - before.y(), other_.at.x() - before.x());
}

void GeneratedWalk::drive(double dt_s) {
  const Vector2d off = person_.at - Vector2d(robot_x_, robot_y_);
  const double along = off.dot(heading(robot_theta_)), beside = off.dot(heading(robot_theta_ - kPi / 2));
  const VelocityCommand wanted = set_point({}, beside, along);
  const auto step = [&](double& x, double& y, double& theta, double speed, double turn) {
    x += speed * dt_s * std::cos(theta + turn * dt_s / 2);
    y += speed * dt_s * std::sin(theta + turn * dt_s / 2);
    theta += turn * dt_s;
  };
  step(robot_x_, robot_y_, robot_theta_, wanted.speed_m_s, wanted.turn_rad_s);
  Odometry& o = frame_.odometry;
  o.speed_m_s = wanted.speed_m_s * (1 + p_.odometry_noise * lot_.normal());
  o.turn_rad_s = wanted.turn_rad_s * (1 + p_.odometry_noise * lot_.normal());
  step(o.x_m, o.y_m, o.theta_rad, o.speed_m_s, o.turn_rad_s);
}

/// Head, trunk, arms that swing and legs that stride.
void GeneratedWalk::dress(const Walker& w) {
  constexpr Bgr kSkin{120, 150, 200}, kTrousers{60, 60, 70}, kSleeve{50, 45, 45};
  const double hip = 0.5 * w.height_m, shoulder = 0.82 * w.height_m, swing = 0.35 * std::sin(w.phase);
  const double bob = 0.02 * std::cos(2 * w.phase), yaw = w.heading_rad + 0.12 * std::sin(w.phase);
  const auto body = [&](double right, double ahead, double up) {
    const Vector2d at = w.at + ahead * heading(yaw) + right * heading(yaw - kPi / 2);
    return Vector3d(at.x(), at.y(), up + bob);
  };
  trunks_.push_back({body(0, 0, hip - 0.05), shoulder - hip + 0.08, 0.20, 0.12, yaw, w.chequered});
  limbs_.push_back({body(0, 0, w.height_m - 0.14), body(0, 0, w.height_m - 0.10), 0.095, kSkin});
  for (const double side : {-1.0, 1.0}) {
    const double stride = side * swing;
    limbs_.push_back({body(0.1 * side, 0, hip), body(0.1 * side, 0.8 * stride, 0.08), 0.07, kTrousers});
    limbs_.push_back(
        {body(0.23 * side, 0, shoulder), body(0.26 * side, -0.8 * stride, shoulder - 0.55), 0.045, kSleeve});
  }
}

/// Distance along a ray to the side of a trunk.
double GeneratedWalk::meet(const Vector3d& origin, const Vector3d& ray, const Trunk& t) {
  const Vector2d ahead = heading(t.yaw_rad), right = heading(t.yaw_rad - kPi / 2);
  const Vector2d from = origin.head<2>() - t.base.head<2>(), along = ray.head<2>();
  const Vector2d a(from.dot(right) / t.half_width_m, from.dot(ahead) / t.half_depth_m);
  const Vector2d b(along.dot(right) / t.half_width_m, along.dot(ahead) / t.half_depth_m);
  const double bb = b.squaredNorm(), ab = a.dot(b), root = ab * ab - bb * (a.squaredNorm() - 1);
  if (root < 0 || bb < 1e-12) return kNever;
  const double distance = (-ab - std::sqrt(root)) / bb, up = origin.z() + distance * ray.z() - t.base.z();
  return distance > 0 && up >= 0 && up <= t.height_m ? distance : kNever;
}

/// Squares along the surface and upwards, on cloth that has wrinkles; the other shirt has stripes.
GeneratedWalk::Bgr GeneratedWalk::shirt_colour(const Trunk& t, const Vector3d& at) const {
  const Vector2d off = at.head<2>() - t.base.head<2>();
  const double angle =
      std::atan2(off.dot(heading(t.yaw_rad - kPi / 2)) / t.half_width_m, off.dot(heading(t.yaw_rad)) / t.half_depth_m);
  const double around = angle * (t.half_width_m + t.half_depth_m) / 2, up = at.z() - t.base.z();
  const double u = around + 0.005 * std::sin(9 * up + 4 * angle), v = up + 0.006 * std::sin(11 * around);
  const auto square = [&](double w) { return static_cast<int>(std::floor(w / p_.square_m)); };
  const int dark = t.chequered ? (square(u) + square(v)) & 1 : square(v) & 1;
  return dark != 0 ? Bgr{28, 26, 25} : Bgr{170, 172, 174};
}

GeneratedWalk::Bgr GeneratedWalk::hall_colour(const Vector3d& at, int wall) const {
  const auto repeats = [](double v, double period, double share) {
    return v - period * std::floor(v / period) < share * period;
  };
  const double u = wall == 0 ? at.y() : at.x(), v = wall == 2 ? at.y() : at.z();
  const int grain = noise_tile_[static_cast<size_t>(texel(v)) * kTile + static_cast<size_t>(texel(u))] - 128;
  int level = 105;
  if (wall == 2 && at.z() < 1) {
    level = 90;
    if (chequered_floor_ && repeats(u, 0.8, 0.5) == repeats(v, 0.8, 0.5)) level = 150;
  } else if (wall == 2) {
    level = 140;
  } else if (wall == 0 && v > 0.9 && v < 2.7) {  // windows in frames
    level = repeats(u, 0.5, 0.85) && repeats(v - 0.9, 0.6, 0.85) ? 165 : 60;
  } else if (wall == 1 && v > 0.8 && v < 2.2 && repeats(u, 3, 0.4)) {  // plaid
    level = 70 + (repeats(u, 0.2, 0.5) ? 50 : 0) + (repeats(v, 0.2, 0.5) ? 50 : 0);
  }
  const auto channel = [&](int value) { return static_cast<uint8_t>(std::clamp(value, 0, 255)); };
  return {channel(level + grain - 6), channel(level + grain), channel(level + grain + 4)};
}

void GeneratedWalk::draw_hall(const Eye& eye) {
  for (int y = 0; y < p_.height; ++y)
    for (int x = 0; x < p_.width; ++x) {
      const Vector3d ray = eye.ray(x, y);
      double nearest = kNever;
      int wall = 0;
      for (int k = 0; k < 3; ++k) {
        const double to = ray[k] > 0 ? (k == 2 ? kCeiling_m : kHall_m) : 0, distance = (to - eye.at[k]) / ray[k];
        if (distance > 0 && distance < nearest) nearest = distance, wall = k;
      }
      const auto at = static_cast<size_t>(y * p_.width + x);
      depth_[at] = static_cast<float>(nearest);
      colour_[at] = hall_colour(eye.at + nearest * ray, wall);
    }
}

void GeneratedWalk::draw_capsule(const Eye& eye, const Capsule& c) {
  const Region box = eye.around((c.from + c.to) / 2, (c.to - c.from).norm() / 2 + c.radius);
  for (int y = std::max(0, box.y); y < std::min(p_.height, box.y + box.height); ++y)
    for (int x = std::max(0, box.x); x < std::min(p_.width, box.x + box.width); ++x) {
      const Vector3d ray = eye.ray(x, y);
      const double distance = body_pose::meet(eye.at, ray, c);
      const auto at = static_cast<size_t>(y * p_.width + x);
      if (distance >= depth_[at]) continue;
      depth_[at] = static_cast<float>(distance);
      const Vector3d met = eye.at + distance * ray;
      const int grain =
          (noise_tile_[static_cast<size_t>(texel(met.z())) * kTile + static_cast<size_t>(texel(met.x() + met.y()))] -
           128) /
          4;
      const auto channel = [&](int value) { return static_cast<uint8_t>(std::clamp(value + grain, 0, 255)); };
      colour_[at] = {channel(c.colour.b), channel(c.colour.g), channel(c.colour.r)};
      mark_[at] = 0;
    }
}

/// Each pixel is the mean of four rays, as the squares may be small.
void GeneratedWalk::draw_trunk(const Eye& eye, const Trunk& t, uint8_t mark) {
  const Region box = eye.around(t.base + Vector3d(0, 0, t.height_m / 2), t.height_m / 2 + t.half_width_m);
  for (int y = std::max(0, box.y); y < std::min(p_.height, box.y + box.height); ++y)
    for (int x = std::max(0, box.x); x < std::min(p_.width, box.x + box.width); ++x) {
      const double distance = meet(eye.at, eye.ray(x, y), t);
      const auto at = static_cast<size_t>(y * p_.width + x);
      if (distance == kNever) continue;
      shirt_pixels_ += mark;
      if (distance >= depth_[at]) continue;
      int sum[3] = {}, rays = 0;
      for (const double dx : {-0.25, 0.25})
        for (const double dy : {-0.25, 0.25}) {
          const Vector3d ray = eye.ray(x + dx, y + dy);
          const double met = meet(eye.at, ray, t);
          if (met == kNever) continue;
          const Bgr c = shirt_colour(t, eye.at + met * ray);
          sum[0] += c.b, sum[1] += c.g, sum[2] += c.r;
          ++rays;
        }
      if (rays == 0) continue;
      depth_[at] = static_cast<float>(distance);
      colour_[at] = {static_cast<uint8_t>(sum[0] / rays), static_cast<uint8_t>(sum[1] / rays),
                     static_cast<uint8_t>(sum[2] / rays)};
      mark_[at] = mark;
    }
}

/// What the sensor makes of it.
void GeneratedWalk::expose(std::vector<uint8_t>& image) {
  image.resize(3 * colour_.size());
  for (int y = 0; y < p_.height; ++y) {
    const auto from = static_cast<size_t>(lot_.in(0, static_cast<double>(sensor_noise_.size())));
    for (int x = 0; x < 3 * p_.width; ++x) {
      const Bgr& c = colour_[static_cast<size_t>(y * p_.width + x / 3)];
      const int level = x % 3 == 0 ? c.b : x % 3 == 1 ? c.g : c.r;
      const int noise = sensor_noise_[(from + static_cast<size_t>(x)) % sensor_noise_.size()];
      image[static_cast<size_t>(3 * y * p_.width + x)] =
          static_cast<uint8_t>(std::clamp(static_cast<int>(level * light_) + noise, 0, 255));
    }
  }
}

void GeneratedWalk::draw(const Eye& eye, std::vector<uint8_t>& image, bool measure) {
  std::fill(mark_.begin(), mark_.end(), uint8_t{0});
  shirt_pixels_ = 0;
  draw_hall(eye);
  for (const Trunk& trunk : trunks_) draw_trunk(eye, trunk, trunk.chequered ? 1 : 0);
  for (const Capsule& limb : limbs_) draw_capsule(eye, limb);
  for (const Capsule& post : posts_) draw_capsule(eye, post);
  if (measure) {
    const auto seen = std::count(mark_.begin(), mark_.end(), 1);
    frame_.visible = shirt_pixels_ == 0 ? 0 : static_cast<double>(seen) / shirt_pixels_;
  }
  expose(image);
}

const WalkFrame& GeneratedWalk::next() {
  const double dt_s = 1 / p_.rate_hz;
  if (frames_ > 0) {
    walk(dt_s);
    drive(dt_s);
  }
  if (p_.second_person) accompany(dt_s);
  frame_.stamp_ns = static_cast<int64_t>(static_cast<double>(++frames_) * 1e9 / p_.rate_hz);
  limbs_.clear();
  trunks_.clear();
  dress(person_);
  if (p_.second_person) dress(other_);

  const mapping_3d::Affine robot =
      mapping_3d::to_affine(mapping_3d::robot_in_odometry({robot_x_, robot_y_, robot_theta_, 0, 0}));
  const mapping_3d::Affine mount = mapping_3d::to_affine(camera_in_robot());
  const auto matrix = [](const mapping_3d::Affine& a) -> Matrix3d {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(a.r);
  };
  const mapping_3d::Position at = mapping_3d::transformed(robot, mount.t[0], mount.t[1], mount.t[2]);
  const Vector2d off = person_.at - Vector2d(robot_x_, robot_y_);
  frame_.person = {off.dot(heading(robot_theta_ - kPi / 2)), off.dot(heading(robot_theta_))};
  Eye eye{{at.x_m, at.y_m, at.z_m}, matrix(robot) * matrix(mount), camera()};
  draw(eye, frame_.left, true);
  eye.at += p_.baseline_m * eye.rotation.col(0);
  draw(eye, frame_.right, false);
  return frame_;
}

}  // namespace takt::person_tracking
