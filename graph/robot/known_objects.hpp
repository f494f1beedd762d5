// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "hal/settings/json.hpp"

/// The robot of a run, asked from outside: a node of type robot_client that takes tasks in words and knows objects.
///
///   const auto clients = robot_clients(run);                                 // of what `top` or `describe` answers
///   ask(connection, task_question(clients.front(), "goal cup_1.level=full"));
///   const auto objects = known_objects(ask(connection, map_question(clients.front())));
namespace takt::robot {

using Json = nlohmann::ordered_json;

/// Of lists, in what `echo` answers: more than any has.
inline constexpr size_t kAllItems = 100'000;

std::vector<std::string> robot_clients(const Json& run);

/// Hands the client a task. The same words twice are two tasks.
Json task_question(const std::string& client, std::string_view words);

/// Asks the client for all objects that it knows.
Json map_question(const std::string& client);

struct KnownObject {
  std::string name, type;
  double x_m = 0, y_m = 0;  ///< in the map
  std::vector<std::pair<std::string, std::string>> states;
};

/// Of the message that answers a map question. Throws nlohmann::json::exception if it is none.
std::vector<KnownObject> known_objects(const Json& message);

/// "level=empty colour=red"
std::string states_text(const KnownObject& object);

/// What is known of OBJECT, or the value of OBJECT.ATTRIBUTE. Error: what is known instead.
tl::expected<std::string, std::string> answer_about(const std::vector<KnownObject>& objects, const std::string& wanted);

}  // namespace takt::robot
