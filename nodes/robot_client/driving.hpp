// SPDX-License-Identifier: Apache-2.0
// One leg at a time: to a place, to objects, to what is unknown, a rotation, a piece straight ahead. Ways are planned
// again when the grid closes them.
#pragma once
#include <array>

#include "nodes/robot_client/stand_off.hpp"
#include "rt/state_archive.hpp"

namespace takt::robot_client {

struct DrivingParameters {
  navigation::PilotParameters pilot;
  navigation::PathParameters path;
  size_t most_cells = 0;     ///< of a grid; 0: there is none, and ways are straight lines
  double patience_s = 5;     ///< a way that is closed may open again
  double stuck_s = 10;       ///< without getting on at all
  double wait_s = 2;         ///< made to stand for an obstacle, which may go away
  double back_m = 0.25;      ///< then the robot draws back by so much
  double back_m_s = 0.15;    ///< so fast
  int most_backs = 3;        ///< of one leg
  double explored_m = 1;     ///< what is still unknown so near to where it looked cannot be seen
  double explore_far_m = 8;  ///< from where exploring began, farther off nothing is looked for
};

enum class Progress : uint8_t {
  under_way,
  arrived,
  failed,
  nothing_left,  ///< of what is unknown, that can be got to
};

/// Poses and places in the map frame. Memory is taken by the constructor. One thread at a time.
class Driving {
 public:
  explicit Driving(const DrivingParameters& parameters);
  /// From the next step() on, ways from the next look() on; grids stay as large as they could be.
  void tune(DrivingParameters parameters);

  /// The grid, anew. False: it is larger than the constructor was told.
  bool look(const navigation::OccupancyView& grid);
  /// Null as long as there was no grid.
  PathPlanner* planner() { return seen_grid_ ? &planner_ : nullptr; }

  void to_place(const Place& place);
  /// Until each is at most `reach_m` away, and looks at them. At most kMostTargets.
  void to_objects(std::span<const Place> objects, double reach_m);
  /// To the nearest known cell beside an unknown one.
  void to_unknown();
  void rotate(double by_rad);
  void ahead(double by_m);
  /// Ends the leg, within the limits of acceleration.
  void stand();
  /// The robot stands at once, by other hands; the leg waits.
  void halt();
  /// Instead of step() while it is made to stand for an obstacle alone: waits, then wants to draw back from it,
  /// straight to where it came from. A way is planned anew behind that; after most_backs the leg fails.
  navigation::Velocity halt_before_obstacle(const PlanarPose& robot, double dt_s);
  /// Exploring begins anew, from here.
  void begin_exploring(const PlanarPose& robot);

  /// What the base is to do for the next `dt_s`.
  navigation::Velocity step(const PlanarPose& robot, double dt_s);
  Progress progress() const { return progress_; }
  /// Why it failed.
  std::string_view reason() const { return reason_; }
  /// Along the way, m.
  double left_m(const PlanarPose& robot) const;
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, planner_, pilot_, seen_grid_, new_grid_, kind_, targets_, count_, reach_m_, amount_, progress_,
               reason_, begun_, closed_s_, halted_s_, halted_at_, backs_, backing_, standing_s_, got_on_, way_, area_,
               explored_, explored_count_);
    if (count_ > kMostTargets) archive.fail();
  }

  static constexpr size_t kMostTargets = 4;

 private:
  enum class Kind : uint8_t { none, place, objects, unknown, rotate, ahead };
  static bool has_way(Kind kind) { return kind == Kind::place || kind == Kind::objects || kind == Kind::unknown; }
  std::span<const Place> targets() const { return std::span(targets_).first(count_); }
  void begin(Kind kind);
  void fail(std::string_view reason);
  bool way_is_free(const PlanarPose& robot);
  PathOutcome find_way(const Place& from);
  void keep_a_way(const PlanarPose& robot);
  navigation::Velocity draw_back(const PlanarPose& robot, double dt_s);
  void notice_standstill(const PlanarPose& robot, double dt_s);
  void note_explored(const Place& place);

  DrivingParameters parameters_;
  PathPlanner planner_;
  navigation::Pilot pilot_;
  bool seen_grid_ = false, new_grid_ = false;

  Kind kind_ = Kind::none;
  std::array<Place, kMostTargets> targets_;
  size_t count_ = 0;
  double reach_m_ = 0, amount_ = 0;
  Progress progress_ = Progress::arrived;
  std::string reason_;
  bool begun_ = false;   ///< the pilot has the leg
  double closed_s_ = 0;  ///< for so long there is no way
  double halted_s_ = 0;  ///< for so long it has been made to stand, all in all, or has drawn back
  PlanarPose halted_at_;
  int backs_ = 0;
  std::optional<PlanarPose> backing_;  ///< from there on it draws back
  double standing_s_ = 0;              ///< for so long it did not get on
  PlanarPose got_on_;                  ///< where it last did
  std::vector<Place> way_, rest_;

  Disc area_;
  std::array<Disc, 64> explored_;  ///< a ring
  size_t explored_count_ = 0;
};

}  // namespace takt::robot_client
