// SPDX-License-Identifier: Apache-2.0
// What a robot is told, in words:
//
//   goal cup_1.level=full [OBJECT.ATTRIBUTE=VALUE ...]   plan and do what makes all of it true
//   do fill cup_1 bottle_2                               one action, its objects in the order of the roles
//   drive 3 1.5 | rotate 90deg | ahead -0.5              behaviours; m and rad unless a unit says otherwise
//   explore                                              drive to what is unknown until nothing unknown is near
//   tell cup_1.level=empty [...]                         believe it; what is under way goes on
//   add cup cup_3 1.2 0.5 | move cup_3 2 0.5 | remove cup_3   what there is, and where, in the map
//   stop
#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/state_archive.hpp"

namespace takt::robot_client {

enum class Verb : uint8_t { goal, act, drive, rotate, ahead, explore, tell, stop, add, move, remove };

/// OBJECT.ATTRIBUTE=VALUE, as it was written.
struct FactText {
  std::string object, attribute, value;
  void remember(StateArchive& archive) { TAKT_STATE(archive, object, attribute, value); }
};

struct Task {
  Verb verb = Verb::stop;
  std::vector<FactText> facts;     ///< of goal and tell: one at least
  std::vector<std::string> words;  ///< of do: the action, its objects; of add: type and object; of move, remove: it
  double x_m = 0, y_m = 0;         ///< of drive, add and move
  double amount = 0;               ///< of rotate rad (left positive), of ahead m
  void remember(StateArchive& archive) { TAKT_STATE(archive, verb, facts, words, x_m, y_m, amount); }
};

constexpr size_t kMostFacts = 8, kMostWords = 5;

/// The error quotes what is wrong and says what is valid. Allocates.
tl::expected<Task, std::string> parse_task(std::string_view text);

/// Whether the task may be begun anew where it was interrupted: it names an end, and no way to it.
constexpr bool names_an_end(Verb verb) { return verb == Verb::goal || verb == Verb::drive || verb == Verb::explore; }

/// Whether it says something of the world, and leaves what is under way.
constexpr bool informs(Verb verb) {
  return verb == Verb::tell || verb == Verb::add || verb == Verb::move || verb == Verb::remove;
}

}  // namespace takt::robot_client
