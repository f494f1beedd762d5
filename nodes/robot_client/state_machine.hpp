// SPDX-License-Identifier: Apache-2.0
// The states of the robot client (thesis Fig. 5.7, arrows as reconstructed in ), as a
// table.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace takt::robot_client {

enum class State : uint8_t { idle, planning, execute, drive, action };
constexpr size_t kStates = 5;
std::string_view to_string(State state);

enum class Event : uint8_t {
  plan_task,
  drive_to,
  perform_action,
  wait,        ///< for the search, the arrival or the outcome
  plan_found,  ///< execute it
  no_plan,     ///< there is none, or nothing has to be done
  arrived,
  action_done,
  goal_reached,
  differs,  ///< the world is not as expected: plan again
  failed,   ///< the drive or the action; or what is executed is given up
  stop,     ///< asked for, in any state
};
constexpr size_t kEvents = 12;
std::string_view to_string(Event event);

/// A state, and of drive and action who called them: what comes after.
struct Mode {
  State state = State::idle;
  State caller = State::idle;
  bool operator==(const Mode&) const = default;
};

/// `to` none: back to the caller.
struct Row {
  State from;
  Event event;
  std::optional<State> to;
  bool ours = false;  ///< not in the thesis
};
std::span<const Row> transitions();

/// Nothing where the event cannot occur.
std::optional<Mode> next(const Mode& mode, Event event);

}  // namespace takt::robot_client
