// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "graph/machines/clock_pair.hpp"
#include "rt/machine/spread.hpp"

namespace takt::machines {

/// What lies between this machine and another one.
struct Way {
  machine::Spread there_and_back;  ///< of small messages, without the time that the other one kept them
  int64_t lost = 0;                ///< of those, not answered
  ClockPair::Offset clock;         ///< of the other machine, minus this one's
  std::optional<double> sends_mbit_s, receives_mbit_s;  ///< payload of UDP; nothing: too much of it was lost
  int mtu = 0;                                          ///< bytes of the largest packet on this way
};

struct WayOptions {
  std::string address;  ///< of the other machine, which measures at the same time
  uint16_t port = 7390;
  int64_t patience_ns = 60'000'000'000;  ///< for the other machine to be there
};

/// Measures for about six seconds, once the other machine does so as well:
///
///   const Way way = measure_way({"10.0.0.2"});    // there: measure_way({"10.0.0.1"})
///
/// First small messages go there and back, then each side sends short trains of packets: how far apart they arrive says
/// how fast the slowest part of the way is. Over UDP, without DDS. Throws std::runtime_error with the next step: the
/// address is none, the port is taken, nobody answers.
Way measure_way(const WayOptions& options);

/// How fast the way is on which that many payloads of `bytes` arrived within `took_ns`, from the first to the last one,
/// Mbit/s.
double train_mbit_s(int count, int bytes, int64_t took_ns);

/// "network: {latency: 2ms, clock_error: 1ms, bandwidth: 930Mbit}" for a graph, on the safe side: a message takes no
/// longer than the slowest went there and back.
std::string network_line(const Way& way);

}  // namespace takt::machines
