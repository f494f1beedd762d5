// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/clock_generator.hpp"

#include <algorithm>

namespace takt::semantic {

ClockGenerator::ClockGenerator(std::vector<TimedRequest> script, const std::vector<std::string>& idle,
                               uint8_t idle_every, Needs needs, const std::vector<std::string>& on_request)
    : script_(std::move(script)), needs_(std::move(needs)), idle_every_(idle_every) {
  for (const TimedRequest& request : script_) target_.push_back(index_of(request.node));
  for (const std::string& id : idle) nodes_[index_of(id)].idles = true;
  for (const Rule& rule : needs_.rules()) of_rule_.push_back(index_of(rule.otherwise.node));
  for (const std::string& id : on_request) nodes_[index_of(id)].scripted.run = 0;
  deviating_.resize(nodes_.size());
}

void ClockGenerator::request(std::string_view ids) {
  constexpr std::string_view kBetween = ", \t\r\n";
  for (NodeState& state : nodes_) {
    const std::string_view id = state.scripted.node;
    state.requested = false;
    for (size_t at = 0; (at = ids.find_first_not_of(kBetween, at)) < ids.size() && !state.requested;) {
      const size_t end = std::min(ids.find_first_of(kBetween, at), ids.size());
      state.requested = ids.substr(at, end - at) == id;
      at = end;
    }
  }
}

size_t ClockGenerator::index_of(std::string_view id) {
  for (size_t i = 0; i < nodes_.size(); ++i)
    if (id == nodes_[i].scripted.node) return i;
  id.copy(nodes_.emplace_back().scripted.node, sizeof(Request::node) - 1);
  return nodes_.size() - 1;
}

void ClockGenerator::update(int64_t elapsed_ns, bool robot_stopped, const Surroundings& around) {
  for (; next_ < script_.size() && script_[next_].after_ns <= elapsed_ns; ++next_) {
    Request& node = nodes_[target_[next_]].scripted;
    if (script_[next_].verb == Verb::pace) node.every = script_[next_].every;
    else node.run = script_[next_].verb == Verb::start;
  }
  for (NodeState& state : nodes_) {
    state.wanted = state.scripted;
    if (state.requested) state.wanted.run = 1;
    if (robot_stopped && state.idles) state.wanted.every = std::max(state.wanted.every, idle_every_);
  }
  needs_.update(around, elapsed_ns);
  for (size_t i = 0; i < of_rule_.size(); ++i) {
    if (needs_.needed(i)) continue;
    const Request& otherwise = needs_.rules()[i].otherwise;
    Request& wanted = nodes_[of_rule_[i]].wanted;
    wanted.run = std::min(wanted.run, otherwise.run);
    wanted.every = std::max(wanted.every, otherwise.every);
  }
  count_ = 0;
  for (const NodeState& state : nodes_)
    if (!state.wanted.run || state.wanted.every > 1) deviating_[count_++] = state.wanted;
}

}  // namespace takt::semantic
