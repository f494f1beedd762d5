// SPDX-License-Identifier: Apache-2.0
// The robot finds its way through a town by asking (thesis App. A; ): asks a pedestrian,
// reads where he points or what he touches on its screen, drives that way on the pavement, stops before a crossing,
// follows whoever wears the chessboard across it, and drives on. Plain data, one step a job.
#pragma once
#include <array>
#include <string_view>

#include "nodes/drive_arbiter/vision_state.hpp"
#include "nodes/mission/way_ahead.hpp"
#include "rt/state_archive.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::mission {

enum class State : uint8_t { seek, look, ask, back, read, confirm, turn, drive, face, follow, done, failed };
std::string_view to_string(State state);

/// A street is never entered by the robot's own will: in every state but `follow` it drives where the grid is free.
drive_arbiter::VisionState vision_of(State state);

struct MissionParameters {
  double view_m = 2.6;           ///< from so far off all of who was asked is seen: nearer, the robot steps back
  size_t readings = 8;           ///< of his arm, until the direction counts
  double look_after_s = 2;       ///< without seeing one the robot looks elsewhere
  double read_within_s = 10;     ///< else somebody is asked again
  double confirm_within_s = 15;  ///< the same, for who touched a direction and has yet to say that it was understood
  int asking = 3;                ///< times at most
  double stop_before_m = 3.5;    ///< so far from the sign of a crossing the robot waits
  double cross_least_m = 3;      ///< no crossing is narrower; behind its sign
  double stand_s = 3;            ///< whoever is followed so far and stands so long has led across
  double leader_after_s = 4;     ///< standing without whoever leads in sight, the robot looks elsewhere
  double follow_within_s = 120;
  double patience_s = 30;  ///< without getting on along the direction
  int crossings = 1;       ///< on the way
  double beyond_m = 4;     ///< past the last one is the end
};

constexpr size_t kMostReadings = 32, kMostTouched = 3;

/// What a step goes by. Poses, places and directions in the odometry's frame; views are read during the step only.
struct Percept {
  int64_t now_ns = 0;
  PlanarPose robot;
  double speed_m_s = 0;
  std::string_view pedestrian;                      ///< name of the nearest one that is seen; empty: none
  navigation::Place pedestrian_at;                  ///< of that one
  std::optional<double> pointed_rad;                ///< where he points, of a body measured since the last step
  std::optional<navigation::Place> sign;            ///< the nearest one of a crossing, measured since the last step
  bool leader = true;                               ///< whoever is followed is in sight, or nobody can tell
  const navigation::OccupancyView* grid = nullptr;  ///< of the ground; null: none yet
  std::string_view answer;                          ///< touched on the screen since the last step; empty: nothing
  uint32_t over = 0;                                ///< number of the newest task that the robot client has ended
};

/// For the robot client.
struct MissionTask {
  uint32_t number = 0;  ///< 0: none yet
  std::string_view text;
};

/// Memory is taken by the constructor. One thread at a time.
class Mission {
 public:
  /// For grids of at most so many cells.
  Mission(const MissionParameters& parameters, const WayAheadParameters& ways, size_t most_cells);
  /// From the next step() on.
  void tune(const MissionParameters& parameters, const WayAheadParameters& ways);
  /// Tasks are numbered from the one after this on.
  void go_on_after(uint32_t task) { number_ = task; }

  void step(const Percept& percept);

  State state() const { return state_; }
  MissionTask task() const { return {number_, {text_.data(), size_}}; }
  /// What the last step() has to say to whoever stands before the robot; empty: nothing.
  std::string_view speech() const { return {speech_.data(), speech_size_}; }
  std::optional<double> direction_rad() const { return direction_rad_; }
  int crossed() const { return crossed_; }
  /// Why it has failed.
  std::string_view trouble() const { return {trouble_.data(), trouble_size_}; }
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, state_, now_ns_, entered_ns_, number_, text_, size_, trouble_, trouble_size_, pedestrian_,
               asked_, crossed_, readings_rad_, read_, touched_, direction_rad_, began_, farthest_m_, sign_,
               to_cross_m_, got_on_ns_, standing_ns_, waiting_ns_, leader_ns_, leader_looks_);
    if (size_ > text_.size() || trouble_size_ > trouble_.size() || read_ > readings_rad_.size() ||
        touched_ >= kMostTouched)
      archive.fail();
  }

 private:
  void enter(State state);
  void fail(std::string_view trouble);
  template <class... Values>
  void tell(const char* format, const Values&... values);
  template <class... Values>
  void say(const char* format, const Values&... values);
  double since_s(int64_t instant_ns) const { return static_cast<double>(now_ns_ - instant_ns) * 1e-9; }

  void seek(const Percept& percept);
  /// True: what was touched has settled what this step does.
  bool answered(const Percept& percept);
  void read(const Percept& percept);
  void confirm(const Percept& percept);
  void drive(const Percept& percept, bool over);
  void follow(const Percept& percept);
  void turn_to_direction(const PlanarPose& robot, State next);

  MissionParameters parameters_;
  WayAhead ways_;
  State state_ = State::seek;
  int64_t now_ns_ = 0, entered_ns_ = 0;
  uint32_t number_ = 0;
  std::array<char, 96> text_{};
  size_t size_ = 0;
  std::array<char, 48> trouble_{};
  size_t trouble_size_ = 0;
  std::array<char, 128> speech_{};
  size_t speech_size_ = 0;

  std::optional<navigation::Place> pedestrian_;  ///< where one was seen last
  int asked_ = 0, crossed_ = 0;
  std::array<double, kMostReadings> readings_rad_{};
  size_t read_ = 0;
  size_t touched_ = 0;  ///< which of the directions that the screen has, while it is to be confirmed
  std::optional<double> direction_rad_;
  PlanarPose began_;                       ///< driving, following, or beyond the last crossing
  double farthest_m_ = 0;                  ///< along the direction since then
  std::optional<navigation::Place> sign_;  ///< of the next crossing, where it was measured last
  double to_cross_m_ = 0;                  ///< from where following began to beyond the crossing, at least
  int64_t got_on_ns_ = 0;                  ///< when it was
  int64_t standing_ns_ = -1;               ///< since when; -1: it drives
  int64_t waiting_ns_ = 0;                 ///< since when for whoever leads across
  int64_t leader_ns_ = 0;                  ///< when he was seen last, or a look for him began
  size_t leader_looks_ = 0;                ///< since it waits
};

}  // namespace takt::mission
