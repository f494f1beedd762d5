// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/state_machine.hpp"

#include <algorithm>
#include <array>

namespace takt::robot_client {
namespace {

using enum State;
constexpr std::nullopt_t kCaller = std::nullopt;

constexpr Row kRows[] = {
    {idle, Event::plan_task, planning},
    {idle, Event::drive_to, drive},
    {idle, Event::perform_action, action},
    {planning, Event::wait, planning},
    {planning, Event::plan_found, execute},
    {planning, Event::no_plan, idle},
    {execute, Event::drive_to, drive},
    {execute, Event::perform_action, action},
    {execute, Event::goal_reached, idle},
    {drive, Event::wait, drive},
    {drive, Event::arrived, kCaller},
    {action, Event::wait, action},
    {action, Event::action_done, kCaller},
    // Beside the thesis's: what goes wrong, and who changes his mind.
    {execute, Event::wait, execute, true},
    {execute, Event::differs, planning, true},
    {execute, Event::failed, idle, true},
    {drive, Event::failed, kCaller, true},
    {action, Event::failed, kCaller, true},
    {idle, Event::stop, idle, true},
    {planning, Event::stop, idle, true},
    {execute, Event::stop, idle, true},
    {drive, Event::stop, idle, true},
    {action, Event::stop, idle, true},
};

constexpr std::array<std::string_view, kStates> kStateNames{"IDLE", "PLANNING", "EXECUTE", "DRIVE", "ACTION"};
constexpr std::array<std::string_view, kEvents> kEventNames{"plan task",    "drive to", "perform action", "wait",
                                                            "plan found",   "no plan",  "arrived",        "action done",
                                                            "goal reached", "differs",  "failed",         "stop"};

}  // namespace

std::string_view to_string(State state) { return kStateNames[static_cast<size_t>(state)]; }
std::string_view to_string(Event event) { return kEventNames[static_cast<size_t>(event)]; }
std::span<const Row> transitions() { return kRows; }

std::optional<Mode> next(const Mode& mode, Event event) {
  const auto* row = std::find_if(std::begin(kRows), std::end(kRows),
                                 [&](const Row& r) { return r.from == mode.state && r.event == event; });
  if (row == std::end(kRows)) return std::nullopt;
  const State to = row->to.value_or(mode.caller);
  if (to == mode.state) return mode;
  const bool called = to == drive || to == action;
  return Mode{to, called ? mode.state : idle};
}

}  // namespace takt::robot_client
