// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/task.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace takt::robot_client {
namespace {

constexpr std::string_view kBlank = " \t\r\n,";
constexpr double kFarthest = 1e4;  // m or rad

constexpr std::array<std::pair<std::string_view, Verb>, 11> kVerbs{{{"goal", Verb::goal},
                                                                    {"do", Verb::act},
                                                                    {"drive", Verb::drive},
                                                                    {"rotate", Verb::rotate},
                                                                    {"ahead", Verb::ahead},
                                                                    {"explore", Verb::explore},
                                                                    {"tell", Verb::tell},
                                                                    {"add", Verb::add},
                                                                    {"move", Verb::move},
                                                                    {"remove", Verb::remove},
                                                                    {"stop", Verb::stop}}};

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> words;
  for (size_t at = 0; (at = text.find_first_not_of(kBlank, at)) != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kBlank, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// A number in m, or in rad; with a unit that one.
std::optional<double> quantity(std::string_view word, bool angle) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const std::string_view unit = word.substr(static_cast<size_t>(end - word.data()));
  if (error != std::errc{} || !(std::abs(value) <= kFarthest)) return std::nullopt;
  if (unit.empty() || unit == (angle ? "rad" : "m")) return value;
  if (angle && unit == "deg") return value * std::numbers::pi / 180;
  return std::nullopt;
}

std::optional<FactText> fact(std::string_view word) {
  const size_t dot = word.find('.'), equals = word.find('=');
  if (dot == std::string_view::npos || equals == std::string_view::npos || dot == 0 || equals < dot + 2 ||
      equals + 1 == word.size())
    return std::nullopt;
  return FactText{std::string(word.substr(0, dot)), std::string(word.substr(dot + 1, equals - dot - 1)),
                  std::string(word.substr(equals + 1))};
}

tl::unexpected<std::string> wrong(std::string_view text, std::string_view form) {
  return tl::make_unexpected(fmt::format("\"{}\" is no task; write {}", text, form));
}

}  // namespace

tl::expected<Task, std::string> parse_task(std::string_view text) {
  const auto words = split(text);
  Task task;
  const auto* verb = kVerbs.end();
  if (!words.empty())
    verb = std::find_if(kVerbs.begin(), kVerbs.end(), [&](const auto& entry) { return entry.first == words[0]; });
  if (verb == kVerbs.end())
    return wrong(text, "goal, do, drive, rotate, ahead, explore, tell, add, move, remove or stop, and what it needs");
  task.verb = verb->second;
  const size_t arguments = words.size() - 1;
  const auto number = [&](size_t i, bool angle, double& into) {
    const auto value = i < words.size() ? quantity(words[i], angle) : std::nullopt;
    into = value.value_or(0);
    return value.has_value();
  };
  switch (task.verb) {
    case Verb::goal:
    case Verb::tell:
      for (size_t i = 1; i < words.size(); ++i) {
        auto f = fact(words[i]);
        if (!f || task.facts.size() == kMostFacts)
          return wrong(text, fmt::format("{} OBJECT.ATTRIBUTE=VALUE, {} at most", words[0], kMostFacts));
        task.facts.push_back(std::move(*f));
      }
      if (task.facts.empty()) return wrong(text, fmt::format("{} OBJECT.ATTRIBUTE=VALUE", words[0]));
      break;
    case Verb::act:
      if (arguments < 2 || arguments > kMostWords) return wrong(text, "do ACTION OBJECT [OBJECT ...]");
      for (size_t i = 1; i < words.size(); ++i) task.words.emplace_back(words[i]);
      break;
    case Verb::drive:
      if (arguments != 2 || !number(1, false, task.x_m) || !number(2, false, task.y_m))
        return wrong(text, "drive X Y, in m");
      break;
    case Verb::rotate:
      if (arguments != 1 || !number(1, true, task.amount)) return wrong(text, "rotate ANGLE, such as 90deg or 1.57");
      break;
    case Verb::ahead:
      if (arguments != 1 || !number(1, false, task.amount)) return wrong(text, "ahead DISTANCE, in m");
      break;
    case Verb::add:
      if (arguments != 4 || !number(3, false, task.x_m) || !number(4, false, task.y_m))
        return wrong(text, "add TYPE OBJECT X Y, in m");
      task.words.assign(words.begin() + 1, words.begin() + 3);
      break;
    case Verb::move:
      if (arguments != 3 || !number(2, false, task.x_m) || !number(3, false, task.y_m))
        return wrong(text, "move OBJECT X Y, in m");
      task.words.emplace_back(words[1]);
      break;
    case Verb::remove:
      if (arguments != 1) return wrong(text, "remove OBJECT");
      task.words.emplace_back(words[1]);
      break;
    case Verb::explore:
    case Verb::stop:
      if (arguments != 0) return wrong(text, fmt::format("{} alone", words[0]));
      break;
  }
  return task;
}

}  // namespace takt::robot_client
