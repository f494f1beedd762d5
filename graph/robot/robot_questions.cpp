// SPDX-License-Identifier: Apache-2.0
#include "graph/robot/robot_questions.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "hal/settings/json_text.hpp"
#include "nodes/robot_client/task.hpp"

namespace takt::robot {

bool RobotQuestions::is_asked(const Json& question) {
  const std::string what = text_of(question, "do");
  return what == "task" || what == "know";
}

Json RobotQuestions::answer(const Json& question) const {
  const Json graph = graph_();
  const auto clients = graph.is_object() ? robot_clients(graph) : std::vector<std::string>();
  const std::string wanted = text_of(question, "client");
  if (clients.empty()) return {{"error", "the run has no node of type robot_client"}};
  const auto client = wanted.empty() ? clients.begin() : std::find(clients.begin(), clients.end(), wanted);
  if (client == clients.end() || (wanted.empty() && clients.size() > 1))
    return {{"error", fmt::format("`client` must be one of: {}", fmt::join(clients, ", "))}};
  return text_of(question, "do") == "task" ? hand_in(*client, text_of(question, "words"))
                                           : what_is(*client, text_of(question, "object"));
}

Json RobotQuestions::hand_in(const std::string& client, const std::string& words) const {
  if (const auto task = robot_client::parse_task(words); !task) return {{"error", task.error()}};
  return ask_(task_question(client, words));
}

Json RobotQuestions::what_is(const std::string& client, const std::string& object) const {
  const Json map = ask_(map_question(client));
  if (!map.contains("message")) return {{"error", map.value("error", "the run does not answer")}};
  const auto text = answer_about(known_objects(map["message"]), object);
  return text ? Json{{"ok", true}, {"text", *text}} : Json{{"error", text.error()}};
}

}  // namespace takt::robot
