// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/evaluate.hpp"

#include <cmath>
#include <optional>

#include "nodes/person_tracking/follower.hpp"
#include "nodes/stereo/matcher.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/units.hpp"

namespace takt::person_tracking {
namespace {

using Eigen::Vector2d;

/// What a tracker says, in the world: nothing if it tracks nobody.
using Said = std::optional<Vector2d>;

struct Sighting {
  int64_t stamp_ns = 0;
  Vector2d at = Vector2d::Zero();
};

/// The last sightings, as the obvious trackers need them.
class LastSightings {
 public:
  explicit LastSightings(double hold_s) : hold_s_(hold_s) {}
  void add(const Sighting& now) { before_ = last_, last_ = now, ++count_; }
  Said held(int64_t stamp_ns) const { return is_old(stamp_ns) ? Said() : last_.at; }
  Said continued(int64_t stamp_ns) const {
    const double between = to_seconds(last_.stamp_ns - before_.stamp_ns);
    if (is_old(stamp_ns) || count_ < 2 || between > hold_s_) return held(stamp_ns);
    return last_.at + (last_.at - before_.at) * (to_seconds(stamp_ns - last_.stamp_ns) / between);
  }

 private:
  bool is_old(int64_t stamp_ns) const { return count_ == 0 || to_seconds(stamp_ns - last_.stamp_ns) > hold_s_; }
  double hold_s_;
  int count_ = 0;
  Sighting before_, last_;
};

/// Scores one tracker on one walk.
class Scorer {
 public:
  explicit Scorer(TrackFigures& figures) : f_(&figures) {}
  /// All in the robot frame.
  void add(const Said& said, const WalkFrame& truth, bool sighted) {
    const VelocityCommand wanted = set_point({}, truth.person.x(), truth.person.y());
    const VelocityCommand got = said ? set_point({}, said->x(), said->y()) : VelocityCommand{};
    f_->speed_m_s.push_back(std::abs(got.speed_m_s - wanted.speed_m_s));
    f_->turn_rad_s.push_back(std::abs(got.turn_rad_s - wanted.turn_rad_s));
    f_->lost += had_ && !said ? 1 : 0;
    f_->recovered += !had_ && said && ever_ ? 1 : 0;
    had_ = said.has_value();
    ever_ = ever_ || had_;
    if (!said) return;
    const double error = (*said - truth.person).norm();
    if (error > kFalse_m) {
      ++f_->false_locks;
      return;
    }
    ++f_->tracked;
    f_->tracked_shown += truth.visible >= kShown ? 1 : 0;
    f_->position_m.push_back(error);
    if (!sighted) f_->hidden_m.push_back(error);
  }

 private:
  TrackFigures* f_;
  bool had_ = false, ever_ = false;
};

/// Disparities as the graph's stereo node makes them by default, of up to 1.2 m.
class Stereo {
 public:
  explicit Stereo(const WalkParameters& walk) : width_(walk.width), height_(walk.height) {
    stereo::MatcherParameters p;
    p.disparities = static_cast<int>(walk.focal_px * walk.baseline_m / 1.0);
    matcher_ = stereo::make_matcher(width_, height_, 3, p);
    const auto pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
    disparity_.resize(pixels);
    confidence_.resize(pixels);
  }
  Disparities of(const WalkFrame& frame) {
    const stereo::DisparityViews out{{disparity_.data(), width_, height_}, {confidence_.data(), width_, height_}};
    if (!matcher_->match({frame.left.data(), width_, height_, 3}, {frame.right.data(), width_, height_, 3}, out))
      return {};
    return {out.disparity};
  }

 private:
  int width_, height_;
  std::unique_ptr<stereo::Matcher> matcher_;
  std::vector<int16_t> disparity_;
  std::vector<uint8_t> confidence_;
};

}  // namespace

WalkFigures measure_walks(const WalkParameters& parameters, const PersonTrackingParameters& tracking_parameters,
                          uint64_t seed, int walks, int frames) {
  WalkFigures figures;
  Stereo stereo(parameters);
  for (int i = 0; i < walks; ++i) {
    GeneratedWalk walk(parameters, seed, static_cast<uint64_t>(i));
    PersonTracking tracking(parameters.width, parameters.height, 3, tracking_parameters);
    LastSightings last(tracking_parameters.tracker.lost_after_s);
    Scorer filter(figures.filter), hold(figures.hold), constant(figures.constant);
    for (int n = 0; n < frames; ++n) {
      const WalkFrame& truth = walk.next();
      const mapping_3d::Affine robot = mapping_3d::to_affine(mapping_3d::robot_in_odometry(truth.odometry));
      const Frame frame{truth.stamp_ns,
                        {truth.left.data(), parameters.width, parameters.height, 3},
                        stereo.of(truth),
                        {walk.camera(), mapping_3d::to_affine(walk.camera_in_robot()), robot}};
      const int64_t start = thread_cpu_ns();
      tracking.look(frame, {}, [] { return true; });
      figures.time_ms.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);

      const auto in_robot = [&](const Vector2d& at) -> Vector2d {
        const Eigen::Matrix2d turn = (Eigen::Matrix2d() << robot.r[0], robot.r[1], robot.r[3], robot.r[4]).finished();
        return turn.transpose() * (at - Vector2d(robot.t[0], robot.t[1]));
      };
      const auto said = [&](const Said& at) -> Said { return at ? Said(in_robot(*at)) : Said(); };
      const PersonTracker& tracker = tracking.tracker();
      const bool sighted = tracker.sight() == Sight::shirt, shown = truth.visible >= kShown;
      ++figures.frames;
      figures.shown += shown ? 1 : 0;
      if (sighted) {
        ++figures.sighted;
        figures.sighted_shown += shown ? 1 : 0;
        figures.wrong_sightings += (in_robot(tracking.shirt_place().at) - truth.person).norm() > kFalse_m ? 1 : 0;
        last.add({truth.stamp_ns, tracking.shirt_place().at});
      }
      filter.add(said(tracker.tracked() ? Said(tracker.estimate().position()) : Said()), truth, sighted);
      hold.add(said(last.held(truth.stamp_ns)), truth, sighted);
      constant.add(said(last.continued(truth.stamp_ns)), truth, sighted);
    }
  }
  return figures;
}

}  // namespace takt::person_tracking
