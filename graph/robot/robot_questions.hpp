// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <utility>

#include "graph/robot/known_objects.hpp"

namespace takt::robot {

/// Questions of people to the robot of a run. `client` names it where there are several.
///
///   {"do": "task", "words": "goal cup_1.level=full"}    {"ok": true}
///   {"do": "know", "object": "cup_1"}                   {"ok": true, "text": "cup_1 is a cup at 0.55 m, 2.25 m;
///   level=full"}
///
/// Whoever asks may wait as long as the run takes. Any thread.
class RobotQuestions {
 public:
  /// `graph`: the run that is there now. `ask`: asks it.
  RobotQuestions(std::function<Json()> graph, std::function<Json(const Json&)> ask)
      : graph_(std::move(graph)), ask_(std::move(ask)) {}

  static bool is_asked(const Json& question);
  Json answer(const Json& question) const;

 private:
  Json hand_in(const std::string& client, const std::string& words) const;
  Json what_is(const std::string& client, const std::string& object) const;

  const std::function<Json()> graph_;
  const std::function<Json(const Json&)> ask_;
};

}  // namespace takt::robot
