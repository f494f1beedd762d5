// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "graph/machines/clock_pair.hpp"
#include "hal/settings/json.hpp"
#include "rt/msg/field.hpp"

namespace takt::machines {

using Json = nlohmann::ordered_json;

/// What a machine says of itself ten times a second, so that nothing depends on one message:
///
///   {"takt": 1, "machine": "vision", "run": 81, "graph": "a1b2", "sent_ns": 5, "facts": {"stereo.disparity": [640,
///   480, 1, 0]},
///    "heard": {"robot": {"run": 7, "sent_ns": 3, "received_ns": 4}}, "told": {"mode": "full"}}
struct State {
  std::string machine;
  uint64_t run = 0;   ///< another number after each start
  std::string graph;  ///< hash of graph, schedule and parameters
  int64_t sent_ns = 0;
  std::map<std::string, Capacity, std::less<>> facts;  ///< by output: how large its messages can become
  struct Heard {
    uint64_t run = 0;
    int64_t sent_ns = 0, received_ns = 0;  ///< of the newest state of that machine: by its clock, by the sender's
  };
  std::map<std::string, Heard, std::less<>> heard;
  Json told;  ///< of its run, for people: {"mode": "full", "misses": 0, "high_misses": 0}
};

std::string text_of(const State& state);
/// Nothing: it is none.
std::optional<State> state_of(std::string_view text);

/// What is known of another machine. One thread hears; any reads the atomics.
class Peer {
 public:
  Peer(std::string name, std::string graph) : name(std::move(name)), graph_(std::move(graph)) {}

  /// False: it runs something else, and is not listened to.
  bool hear(const State& state, std::string_view own_name, uint64_t own_run, int64_t now_ns);
  const std::string name;
  std::atomic<int64_t> heard_ns{INT64_MIN};  ///< when it was heard last
  std::atomic<bool> differs{false};          ///< it runs another graph, schedule or other parameters
  ClockPair clock;                           ///< of the hearing thread
  Stamps stamps;                             ///< likewise
  State newest;                              ///< likewise

 private:
  const std::string graph_;
};

}  // namespace takt::machines
