// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <string>

#include "nodes/mapping_3d/head_at.hpp"
#include "nodes/person_tracking/follower.hpp"
#include "nodes/person_tracking/person_tracking.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace person_tracking;

constexpr size_t kMostBodies = 64;
constexpr int64_t kOldBody_ns = 400'000'000;
constexpr int64_t kOldHead_ns = 500'000'000;
constexpr double kBodySigma_m = 0.15;                                     // of a body's head from the person's middle
constexpr double kAnyYaw_rad2 = std::numbers::pi * std::numbers::pi / 3;  // of a direction that may be any
constexpr double kBodySpeed_m_s = 1.0;                                    // that he may have walked since

class PersonTrackingNode final : public Node {
 public:
  void setup(Setup&) override {
    const Capacity& images = pair_.capacity();
    if (images.channels != 1 && images.channels != 3)
      throw SetupError("`pair` has " + std::to_string(images.channels) + " channels, must have 1 or 3");
    tracking_.emplace(static_cast<int>(images.width), static_cast<int>(images.height),
                      static_cast<int>(images.channels), parameters());
    shirts_.reserve({0, 0, 1, ChessboardFinder::kLevels * ChessboardFinder::kMostBoards});
  }

  void changed() override { tracking_->tune(parameters()); }

  void run(Job& job) override {
    const StereoPair* pair = pair_.newest();
    const auto camera = pair != nullptr && usable(*pair) ? camera_at(*pair) : std::nullopt;
    const bool looks = camera && pair_.is_new();
    if (looks) look(job, *pair, *camera);
    else tracking_->wait(job.release_ns());
    const int64_t stamp_ns = looks ? pair_.stamp_ns() : job.release_ns();
    const auto robot = robot_at(stamp_ns);
    bool sent = send_command(robot, stamp_ns);
    if (looks) {
      const bool person_sent = send_person(robot, stamp_ns), shirts_sent = send_shirts(*pair, stamp_ns);
      sent = sent && person_sent && shirts_sent;
    }
    if (!looks || !sent) job.no_result();
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, tracking_); }

 private:
  PersonTrackingParameters parameters() const {
    PersonTrackingParameters p;
    p.shirt.square_m = square_;
    p.shirt.range_max_m = range_max_;
    p.tracker.filter.acceleration = acceleration_;
    p.tracker.confirm = confirm_;
    p.tracker.lost_after_s = lost_after_;
    p.tracker.shirt_within_s = shirt_within_;
    return p;
  }

  static bool is_known(const Transform& t) {
    return t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
  }
  bool usable(const StereoPair& pair) const {
    const Capacity& images = pair_.capacity();
    return pair.camera.focal_px > 0 && is_known(pair.sensor_in_robot) && pair.width == static_cast<int>(images.width) &&
           pair.height == static_cast<int>(images.height) && pair.channels == static_cast<int>(images.channels);
  }

  /// In the robot frame, at the newest pair's stamp; none: not known, since where the head was is not.
  std::optional<mapping_3d::Affine> camera_at(const StereoPair& pair) const {
    if (!head_.connected()) return mapping_3d::to_affine(pair.sensor_in_robot);
    const auto head = mapping_3d::head_at(head_, pair_.stamp_ns(), kOldHead_ns);
    if (!head) return std::nullopt;
    return mapping_3d::to_affine(mapping_3d::turned_by_head(pair.sensor_in_robot, head->pan_rad, head->tilt_rad));
  }

  /// The robot in the odometry's frame at a stamp: the message nearest to it, continued at its speed.
  mapping_3d::Affine robot_at(int64_t stamp_ns) const {
    if (odometry_.empty()) return {};
    size_t nearest = 0;
    for (size_t i = 1; i < odometry_.size(); ++i)
      if (std::abs(odometry_.stamp_ns(i) - stamp_ns) <= std::abs(odometry_.stamp_ns(nearest) - stamp_ns)) nearest = i;
    Odometry then = odometry_[nearest];
    const double dt_s = static_cast<double>(stamp_ns - odometry_.stamp_ns(nearest)) * 1e-9;
    const double middle = then.theta_rad + then.turn_rad_s * dt_s / 2;
    then.x_m += then.speed_m_s * dt_s * std::cos(middle);
    then.y_m += then.speed_m_s * dt_s * std::sin(middle);
    then.theta_rad += then.turn_rad_s * dt_s;
    return mapping_3d::to_affine(mapping_3d::robot_in_odometry(then));
  }

  void look(Job& job, const StereoPair& pair, const mapping_3d::Affine& camera) {
    Frame frame{pair_.stamp_ns(), pair.left_view(), {}, {pair.camera, camera, robot_at(pair_.stamp_ns())}};
    const DisparityMap* map = disparity_.newest();
    if (map != nullptr && disparity_.stamp_ns() == frame.stamp_ns && map->width == pair.width &&
        map->height == pair.height) {
      frame.disparities.whole = map->view();
      if (map->fraction.size == map->disparity.size) frame.disparities.fraction = map->fraction_view();
    }
    const auto reserve_ns = static_cast<int64_t>(reserve_() * 1e9);
    tracking_->look(frame, places_of_bodies(frame.stamp_ns), [&] { return job.time_left_ns() > reserve_ns; });
  }

  /// Heads of the newest bodies, where they were: the longer ago, the less is known.
  std::span<const Place> places_of_bodies(int64_t stamp_ns) {
    const BodyPoses* poses = bodies_.newest();
    if (poses == nullptr || !bodies_.is_new() || std::abs(stamp_ns - bodies_.stamp_ns()) > kOldBody_ns) return {};
    const mapping_3d::Affine robot = robot_at(bodies_.stamp_ns());
    const double walked = kBodySpeed_m_s * static_cast<double>(std::abs(stamp_ns - bodies_.stamp_ns())) * 1e-9;
    const double variance = kBodySigma_m * kBodySigma_m + walked * walked;
    size_t count = 0;
    for (const Body& body : poses->bodies.items()) {
      if (count == body_places_.size()) break;
      const mapping_3d::Position at = mapping_3d::transformed(robot, body.joints[0].x, body.joints[0].y, 0);
      body_places_[count++] = {{at.x_m, at.y_m}, variance * Eigen::Matrix2d::Identity()};
    }
    return std::span(body_places_).first(count);
  }

  /// The rotation of the robot seen from above, and a place of the world in its frame.
  static Eigen::Matrix2d turn_of(const mapping_3d::Affine& robot) {
    return (Eigen::Matrix2d() << robot.r[0], robot.r[1], robot.r[3], robot.r[4]).finished();
  }
  static Eigen::Vector2d in_robot(const mapping_3d::Affine& robot, const Eigen::Vector2d& at) {
    return turn_of(robot).transpose() * (at - Eigen::Vector2d(robot.t[0], robot.t[1]));
  }

  bool send_command(const mapping_3d::Affine& robot, int64_t stamp_ns) {
    VelocityCommand* out = command_.connected() ? command_.loan() : nullptr;
    if (out == nullptr) return !command_.connected();
    const FollowerParameters follower{distance_, speed_gain_, turn_gain_, speed_max_, turn_max_, reverse_max_};
    const Eigen::Vector2d at = in_robot(robot, tracking_->tracker().at(stamp_ns).position());
    *out = tracking_->tracker().tracked() ? set_point(follower, at.x(), at.y()) : VelocityCommand{};
    command_.send(stamp_ns);
    return true;
  }

  /// Only while somebody is tracked.
  bool send_person(const mapping_3d::Affine& robot, int64_t stamp_ns) {
    const PersonTracker& tracker = tracking_->tracker();
    Pose* out = person_.connected() && tracker.tracked() ? person_.loan() : nullptr;
    if (out == nullptr) return !person_.connected() || !tracker.tracked();
    const Estimate now = tracker.at(stamp_ns);
    const Eigen::Matrix2d turn = turn_of(robot).transpose();
    const Eigen::Vector2d at = in_robot(robot, now.position()), velocity = turn * now.velocity();
    const Eigen::Matrix2d of_place = turn * now.covariance.topLeftCorner<2, 2>() * turn.transpose();
    const Eigen::Matrix2d of_velocity = turn * now.covariance.bottomRightCorner<2, 2>() * turn.transpose();
    const double yaw = std::atan2(-velocity.x(), velocity.y());
    const Eigen::Vector2d across(std::cos(yaw), std::sin(yaw));
    out->transform = {at.x(), at.y(), 0, std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(out->covariance);
    covariance.setZero();
    covariance.topLeftCorner<2, 2>() = of_place;
    covariance(5, 5) =
        std::min(kAnyYaw_rad2, across.dot(of_velocity * across) / std::max(1e-9, velocity.squaredNorm()));
    person_.send(stamp_ns);
    return true;
  }

  bool send_shirts(const StereoPair& pair, int64_t stamp_ns) {
    Detections* out = shirts_.connected() ? shirts_.loan() : nullptr;
    if (out == nullptr) return !shirts_.connected();
    out->image_width = pair.width;
    out->image_height = pair.height;
    out->searched = tracking_->searched();
    for (const Board& board : tracking_->boards()) {
      const bool followed = tracking_->tracker().sight() == Sight::shirt && &board == &tracking_->shirt();
      const auto corners = static_cast<float>(board.corners);
      out->boxes.push_back({followed ? 1.0f : 0.0f, static_cast<float>(board.box.x), static_cast<float>(board.box.y),
                            static_cast<float>(board.box.width), static_cast<float>(board.box.height),
                            corners / (corners + 8)});
    }
    shirts_.send(stamp_ns);
    return true;
  }

  Input<StereoPair> pair_{this, "pair", "rectified; the left image is searched, once"};
  Input<DisparityMap> disparity_{
      this, "disparity", "of the pair, same stamp; without it ranges come from the shirt's size", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "how the robot moves; without it it stands; depth 16", Need::optional};
  Input<HeadState> head_{this, "head", "where the camera sits on the head; depth 16", Need::optional};
  Input<BodyPoses> bodies_{this, "bodies", "hold a person whose shirt is not seen", Need::optional};
  Output<Pose> person_{this, "person", "the person in the shirt, robot frame: y axis where he walks; none: nobody"};
  Output<Detections> shirts_{this, "shirts", "chessboards in the left image; class 1: the one that is followed"};
  Output<VelocityCommand> command_{this, "command", "set-point for following him; 0 0 while nobody is tracked"};

  Param<double> square_{this, "square", ShirtParameters{}.square_m, {0.01, 0.5}, "m", "edge of a square of the shirt"};
  Param<double> range_max_{this,        "range_max", ShirtParameters{}.range_max_m,
                           {1.0, 30.0}, "m",         "farther shirts are none"};
  Param<double> acceleration_{this,
                              "acceleration",
                              FilterParameters{}.acceleration,
                              {0.01, 100.0},
                              "1",
                              "power spectral density of its noise, m^2/s^3"};
  Param<int> confirm_{this,     "confirm", TrackerParameters{}.confirm,
                      {1, 100}, "",        "consecutive images with the shirt until it counts"};
  Param<double> lost_after_{this,        "lost_after", TrackerParameters{}.lost_after_s,
                            {0.1, 10.0}, "s",          "unseen for so long he is lost"};
  Param<double> shirt_within_{this,
                              "shirt_within",
                              TrackerParameters{}.shirt_within_s,
                              {0.1, 60.0},
                              "s",
                              "nor do bodies alone hold him longer"};
  Param<double> distance_{this, "distance", FollowerParameters{}.distance_m, {0.3, 10.0}, "m", "that the robot keeps"};
  Param<double> speed_gain_{this,        "speed_gain", FollowerParameters{}.speed_gain,
                            {0.0, 10.0}, "1",          "m/s per metre too far"};
  Param<double> turn_gain_{this,        "turn_gain", FollowerParameters{}.turn_gain,
                           {0.0, 10.0}, "1",         "rad/s per rad off the direction"};
  Param<double> speed_max_{this, "speed_max", FollowerParameters{}.speed_max_m_s, {0.0, 2.0}, "m/s", "limit"};
  Param<double> turn_max_{this, "turn_max", FollowerParameters{}.turn_max_rad_s, {0.0, 3.0}, "rad/s", "limit"};
  Param<double> reverse_max_{this,       "reverse_max", FollowerParameters{}.reverse_max_m_s,
                             {0.0, 2.0}, "m/s",         "limit backwards, where there are no eyes"};
  Param<double> reserve_{this, "reserve", 0.002, {0.0, 0.1}, "s", "with less time left than this the search ends"};

  std::optional<PersonTracking> tracking_;
  std::array<Place, kMostBodies> body_places_;
};

}  // namespace

void register_person_tracking(NodeTypes& types) {
  types.add<PersonTrackingNode>("person_tracking", Layer::perception,
                                "The person in a chessboard T-shirt: where he is and goes, and how to follow him");
}

}  // namespace takt
