// SPDX-License-Identifier: Apache-2.0
#include "graph/robot/known_objects.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <tuple>

#include "rt/msg/ace/object_reports.hpp"

namespace takt::robot {
namespace {

/// Two texts of one element, each ended by 0, as echo gives them: one number a character.
std::pair<std::string, std::string> two_texts(const Json& element) {
  std::pair<std::string, std::string> texts;
  for (size_t i = 0; i < element.size(); ++i) {
    const auto c = static_cast<char>(element[i].get<int>());
    std::string& text = i < sizeof(ObjectName::name) ? texts.first : texts.second;
    if (c != '\0') text += c;
  }
  return texts;
}

}  // namespace

std::vector<std::string> robot_clients(const Json& run) {
  std::vector<std::string> clients;
  for (const Json& node : run.value("nodes", Json::array()))
    if (node.value("type", "") == "robot_client") clients.push_back(node.value("name", ""));
  return clients;
}

/// A number before the text makes the same words another task.
Json task_question(const std::string& client, std::string_view words) {
  const auto number = std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1);
  return {{"do", "set"}, {"param", client + ".task"}, {"value", fmt::format("{} {}", number, words)}};
}

Json map_question(const std::string& client) {
  return {{"do", "echo"}, {"port", client + ".map"}, {"count", 1}, {"items", kAllItems}};
}

std::vector<KnownObject> known_objects(const Json& message) {
  std::vector<KnownObject> objects;
  size_t state = 0;
  const Json &names = message.at("names").at("first"), &places = message.at("places").at("first"),
             &attributes = message.at("attributes").at("first");
  for (size_t i = 0; i < names.size(); ++i) {
    KnownObject object;
    std::tie(object.name, object.type) = two_texts(names[i]);
    object.x_m = places.at(i).at(0).get<double>();
    object.y_m = places.at(i).at(1).get<double>();
    for (auto left = places.at(i).at(5).get<double>(); left > 0; --left)
      object.states.push_back(two_texts(attributes.at(state++)));
    objects.push_back(std::move(object));
  }
  return objects;
}

std::string states_text(const KnownObject& object) {
  std::string text;
  for (const auto& [name, value] : object.states) text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
  return text;
}

tl::expected<std::string, std::string> answer_about(const std::vector<KnownObject>& objects,
                                                    const std::string& wanted) {
  const std::string name = wanted.substr(0, wanted.find('.'));
  const auto object =
      std::find_if(objects.begin(), objects.end(), [&](const KnownObject& known) { return known.name == name; });
  if (object == objects.end()) {
    std::vector<std::string> names;
    for (const KnownObject& known : objects) names.push_back(known.name);
    return tl::make_unexpected(fmt::format("the robot knows no object {}; it knows: {}", name,
                                           names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  const std::string states = object->states.empty() ? "no state" : states_text(*object);
  if (name == wanted)
    return fmt::format("{} is a {} at {:.2f} m, {:.2f} m; {}", object->name, object->type, object->x_m, object->y_m,
                       object->states.empty() ? "no state is known" : states);
  const auto state = std::find_if(object->states.begin(), object->states.end(),
                                  [&](const auto& known) { return known.first == wanted.substr(name.size() + 1); });
  if (state == object->states.end()) return tl::make_unexpected(fmt::format("of {} the robot knows {}", name, states));
  return state->second;
}

}  // namespace takt::robot
