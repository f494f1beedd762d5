// SPDX-License-Identifier: Apache-2.0
#include "graph/check/network.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/language/words.hpp"
#include "rt/machine/parse.hpp"

namespace takt::graph {
namespace {

// What a message of n bytes takes on a wire. It goes in pieces of kPiece (FragmentSize in graph/machines/dds), each
// behind a DATA_FRAG and, encrypted, a prefix and a postfix; and these in frames of Ethernet. Sources: RTPS 2.5,
// section 9.4.5.5; DDS Security 1.1, section 9.5.3.3; IEEE 802.3 with preamble and gap.
constexpr double kPiece = 1344, kAroundPiece = 44 + 96, kFrame = 1500 - 20 - 8, kAroundFrame = 20 + 8 + 38;
constexpr double kAroundMessage = 200;  ///< frame of graph/machines, heads of RTPS

double wire_bits(uint64_t bytes) {
  const double all = static_cast<double>(bytes) + kAroundMessage;
  const double packed = all * (kPiece + kAroundPiece) / kPiece;
  return 8 * packed * (kFrame + kAroundFrame) / kFrame;
}

std::string mbit(double bit_s) { return fmt::format("{:.2f} Mbit/s", bit_s / 1e6); }

}  // namespace

NetworkLoad network_load(const GraphSpec& graph, const Plan& plan) {
  NetworkLoad load;
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    for (const size_t p : plan.tasks[t].ports) {
      const PortPlan& port = plan.ports[p];
      const std::string name = port.node + "." + port.port;
      const auto device =
          std::find_if(graph.devices.begin(), graph.devices.end(), [&](const auto& d) { return d.id == port.node; });
      const bool comes = device != graph.devices.end() && device->remote &&
                         std::count(device->remote->ports.begin(), device->remote->ports.end(), port.port) > 0;
      const auto goes = graph.export_readers.find(name);
      if (!comes && goes == graph.export_readers.end()) continue;
      const double rate = effective_rate_hz(plan, t);
      if (comes) load.in_bit_s += wire_bits(port.message_bytes()) * rate / 2;  // a remote device has twice the rate
      else load.out_bit_s += wire_bits(port.message_bytes()) * rate * static_cast<double>(goes->second.size());
      if (port.message_bytes() > load.largest_bytes) load.largest_bytes = port.message_bytes(), load.largest = name;
    }
  return load;
}

std::optional<NetworkCheck> check_network(const GraphSpec& graph, const Plan& plan, const machine::Facts& facts) {
  if (graph.machine.empty()) return std::nullopt;
  NetworkCheck check{network_load(graph, plan), "", open_addresses(graph)};
  const auto& [out, in, largest_bytes, largest] = check.load;
  if (const auto& bandwidth = graph.network.bandwidth; !bandwidth)
    check.notes.push_back(
        "the network is not proven to carry this: `network` has no `bandwidth`; `takt doctor --measure --peer ADDRESS` "
        "on both machines finds it");
  else if (const double most = std::max(out, in); most > static_cast<double>(*bandwidth))
    check.problem = fmt::format(
        "machine {} {} up to {}, and `bandwidth` of `network` is {}; lower the rate or size of what others read "
        "(the largest is {} with {} bytes), or have a faster network",
        ticked(graph.machine), out >= in ? "sends" : "receives", mbit(most), mbit(static_cast<double>(*bandwidth)),
        largest, largest_bytes);
  if (const std::string cure = small_buffers(largest_bytes, facts); !cure.empty())
    check.notes.push_back(
        fmt::format("{} has up to {} bytes, and the kernel buffers less than {} of them: pieces are "
                    "lost when they come at once; run:  {}",
                    largest, largest_bytes, kBufferedMessages, cure));
  return check;
}

std::vector<std::string> open_addresses(const GraphSpec& graph) {
  std::vector<std::string> lines;
  if (graph.machine.empty() || !graph.network.keys.empty()) return lines;
  for (const MachineSpec& machine : graph.machines)
    if (!is_private(machine.address))
      lines.push_back(
          fmt::format("machine {} has the address {}, which is not of a private network: without keys anybody "
                      "there can listen and send; `takt keys` makes them, --keys uses them",
                      ticked(machine.name), machine.address));
  return lines;
}

std::string small_buffers(uint64_t largest_bytes, const machine::Facts& facts) {
  const auto limit = machine::parse_number(facts.text("/proc/sys/net/core/rmem_max").value_or(""));
  // The kernel counts what its packets take, about twice their bytes, and doubles what is asked for.
  const uint64_t wanted = kBufferedMessages * largest_bytes;
  if (!limit || *limit < 0 || static_cast<uint64_t>(*limit) >= wanted) return "";
  return fmt::format("sudo sysctl -w net.core.rmem_max={}", (wanted / (1 << 20) + 1) * (1 << 20));
}

nlohmann::ordered_json to_json(const NetworkCheck& check) {
  return {{"out_mbit_s", check.load.out_bit_s / 1e6},
          {"in_mbit_s", check.load.in_bit_s / 1e6},
          {"largest", check.load.largest},
          {"largest_bytes", check.load.largest_bytes}};
}

std::string network_text(const NetworkCheck& check, const NetworkSpec& network) {
  return fmt::format(
      "network: sends {}, receives {} at most{}\n", mbit(check.load.out_bit_s), mbit(check.load.in_bit_s),
      network.bandwidth ? fmt::format(", of {} each way", mbit(static_cast<double>(*network.bandwidth))) : "");
}

}  // namespace takt::graph
