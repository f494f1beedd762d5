// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <string_view>

#include "hal/sim/world.hpp"
#include "rt/msg/ace/action.hpp"

namespace takt::sim {

class Stage;

/// Carries the actions of one robot out. An action begins kLatencyNs after its command and lasts its cost, longer or
/// shorter by a share that seed, robot and action decide, `spread` at most; at its begin
/// and at its end each object has to be within reach and each requirement has to hold, then its results come true. One
/// thread; settled_ns() any.
///
/// Robots work on the same objects without locks: what a command does, it does kLatencyNs later at the earliest (the
/// lookahead of Chandy and Misra 1979), so each robot's run goes up to the instant to which all others have settled
/// theirs, and what happens is in the order of instants, then of clients, whoever's job came first. Jobs of n robots
/// within kLatencyNs / (n + 1) of each other settle everything before it happens (of one robot: within kLatencyNs);
/// with slower ones a change may come to be known after its instant. Who says nothing for half a second is not waited
/// for.
class ActionRun {
 public:
  /// `robot`: its client in the stage's world. The stage must outlive this.
  ActionRun(Stage& stage, size_t robot) : stage_(stage), robot_(robot) {}

  /// From that instant on, until stop(), the other robots mind what this one does.
  void start(int64_t at_ns, double spread = 0);
  void stop() { settled_ns_.store(INT64_MAX, std::memory_order_release); }

  /// A new number is a new action, and number 0 none; what is under way and not over when the new one begins is given
  /// up. False if it cannot be taken now: too many came in too short a time.
  bool command(const ActionCommand& command, int64_t at_ns);
  /// Settles what happens up to now + kLatencyNs.
  void advance(int64_t now_ns);
  /// Of the newest command; at an instant that the newest advance() has reached.
  ActionOutcome outcome(int64_t at_ns) const;

  /// Nothing that this robot does will change anything up to that instant any more.
  int64_t settled_ns() const { return settled_ns_.load(std::memory_order_acquire); }

 private:
  struct Doing {
    uint32_t number = 0;
    const WorldAction* action = nullptr;
    std::array<size_t, 4> objects{};  ///< by role
    int64_t begin_ns = 0, end_ns = 0;
    bool begun = false;
    int64_t next_ns() const { return begun ? end_ns : begin_ns; }
  };
  struct Verdict {
    uint32_t number = 0;
    uint8_t state = action_state::none;
    int64_t at_ns = 0;
    char reason[sizeof ActionOutcome::reason] = {};
  };
  struct Reason;

  bool understand(const ActionCommand& command, Doing& doing, Reason& reason) const;
  bool possible(const Doing& doing, int64_t at_ns, Reason& reason) const;
  bool possible_move(const Doing& doing, const RoleMove& move, int64_t at_ns, Reason& reason) const;
  void apply(const Doing& doing);
  /// The front of what waits has come to its begin or its end.
  void proceed();
  bool others_settled(int64_t at_ns) const;
  int64_t duration_ns(const WorldAction& action) const;
  void judge(const Doing& doing, uint8_t state, int64_t at_ns, const Reason& reason);

  Stage& stage_;
  size_t robot_;
  std::array<Doing, 4> waiting_{};  ///< in the order of their instants
  size_t waiting_count_ = 0;
  uint32_t newest_ = 0;
  int64_t newest_begin_ns_ = 0;
  double spread_ = 0;
  Verdict verdict_;
  std::atomic<int64_t> settled_ns_{INT64_MAX};
};

}  // namespace takt::sim
