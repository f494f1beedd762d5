// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/peer.hpp"

namespace takt::machines {
namespace {

constexpr int kVersion = 1;

Json numbers(const Capacity& capacity) {
  return Json::array({capacity.width, capacity.height, capacity.channels, capacity.count});
}

Capacity capacity_of(const Json& numbers) {
  return {numbers.at(0).get<uint32_t>(), numbers.at(1).get<uint32_t>(), numbers.at(2).get<uint32_t>(),
          numbers.at(3).get<uint32_t>()};
}

}  // namespace

std::string text_of(const State& state) {
  Json facts = Json::object(), heard = Json::object();
  for (const auto& [port, capacity] : state.facts) facts[port] = numbers(capacity);
  for (const auto& [machine, of] : state.heard)
    heard[machine] = {{"run", of.run}, {"sent_ns", of.sent_ns}, {"received_ns", of.received_ns}};
  return Json{{"takt", kVersion},         {"machine", state.machine}, {"run", state.run}, {"graph", state.graph},
              {"sent_ns", state.sent_ns}, {"facts", facts},           {"heard", heard},   {"told", state.told}}
      .dump();
}

std::optional<State> state_of(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || json.value("takt", Json()) != kVersion) return std::nullopt;
  try {
    State state;
    state.machine = json.at("machine").get<std::string>();
    state.run = json.at("run").get<uint64_t>();
    state.graph = json.at("graph").get<std::string>();
    state.sent_ns = json.at("sent_ns").get<int64_t>();
    state.told = json.value("told", Json());
    for (const auto& [port, capacity] : json.at("facts").items()) state.facts[port] = capacity_of(capacity);
    for (const auto& [machine, of] : json.at("heard").items())
      state.heard[machine] = {of.at("run").get<uint64_t>(), of.at("sent_ns").get<int64_t>(),
                              of.at("received_ns").get<int64_t>()};
    return state;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

bool Peer::hear(const State& state, std::string_view own_name, uint64_t own_run, int64_t now_ns) {
  differs.store(state.graph != graph_);
  if (differs.load()) return false;
  heard_ns.store(now_ns);
  if (const auto mine = state.heard.find(own_name); mine != state.heard.end() && mine->second.run == own_run)
    clock.add({mine->second.sent_ns, mine->second.received_ns, state.sent_ns, now_ns});
  newest = state;
  return true;
}

}  // namespace takt::machines
