// SPDX-License-Identifier: Apache-2.0
// What goes over the network between the machines of a graph, and whether that is enough and closed.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"
#include "rt/machine/facts.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Of the part of one machine, at most: messages as large as they can become, at the rates of the schedule, with what
/// Ethernet, IP, UDP and RTPS put around each piece, and encryption.
struct NetworkLoad {
  double out_bit_s = 0, in_bit_s = 0;
  uint64_t largest_bytes = 0;  ///< message that comes or goes
  std::string largest;         ///< its output
};
NetworkLoad network_load(const GraphSpec& graph, const Plan& plan);

/// What a check says of the network; nothing for a graph on one machine.
struct NetworkCheck {
  NetworkLoad load;
  std::string problem;  ///< the declared `bandwidth` is too little; "": it is enough, or not declared
  std::vector<std::string> notes;
};
std::optional<NetworkCheck> check_network(const GraphSpec& graph, const Plan& plan, const machine::Facts& facts);

/// Of the machines of a graph without keys whose addresses others may reach; a line each.
std::vector<std::string> open_addresses(const GraphSpec& graph);

nlohmann::ordered_json to_json(const NetworkCheck& check);
std::string network_text(const NetworkCheck& check, const NetworkSpec& network);

/// Messages that a receive buffer should have room for: the next one may come while the first is being taken.
inline constexpr uint64_t kBufferedMessages = 2;

/// Where the kernel limits receive buffers to less than that many bytes: the line of sysctl that raises it; else "".
std::string small_buffers(uint64_t largest_bytes, const machine::Facts& facts);

}  // namespace takt::graph
