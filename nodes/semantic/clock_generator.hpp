// SPDX-License-Identifier: Apache-2.0
// Which nodes run at what pace at present (thesis Sec. 2.2, 5.3.2; ): the semantic
// processing starts, stops and clocks the others. It asks; the runtime obeys at the nodes' own releases.
#pragma once
#include <span>
#include <vector>

#include "nodes/semantic/needs.hpp"
#include "rt/msg/requests.hpp"
#include "rt/state_archive.hpp"

namespace takt::semantic {

/// Memory is taken by the constructor; update() allocates nothing. One thread at a time.
class ClockGenerator {
 public:
  ClockGenerator() = default;
  /// `script` ascending in time; `idle` nodes run at every `idle_every`-th release while the robot is stopped;
  /// `on_request` ones are stopped until the script starts them, or request() names them. What is asked of a node is
  /// the least of what script, list and the rules that do not need it leave.
  ClockGenerator(std::vector<TimedRequest> script, const std::vector<std::string>& idle, uint8_t idle_every,
                 Needs needs = {}, const std::vector<std::string>& on_request = {});

  /// From the next update() on.
  void tune(uint8_t idle_every, const NeedParameters& needs) {
    idle_every_ = idle_every;
    needs_.tune(needs);
  }

  /// From the next update() on the nodes named run whatever the script says, until another list leaves them out: ids
  /// joined by commas or spaces. Those of no list are not looked for.
  void request(std::string_view ids);

  /// `elapsed_ns` since the first job, never less than in the call before.
  void update(int64_t elapsed_ns, bool robot_stopped, const Surroundings& around = {});

  /// Of the nodes named in script, lists and rules: those that deviate from their full rate, in the order of their
  /// first naming.
  std::span<const Request> deviating() const { return {deviating_.data(), count_}; }
  size_t nodes() const { return nodes_.size(); }
  void remember(StateArchive& archive) { TAKT_STATE(archive, needs_, nodes_, next_); }

 private:
  struct NodeState {
    Request scripted;  ///< as the script left it
    Request wanted;    ///< now
    bool idles = false;
    bool requested = false;
  };
  size_t index_of(std::string_view id);  ///< in nodes_; added if it is new

  std::vector<TimedRequest> script_;
  Needs needs_;
  std::vector<size_t> target_, of_rule_;  ///< index into nodes_ for each request of the script, each rule
  std::vector<NodeState> nodes_;
  std::vector<Request> deviating_;
  size_t next_ = 0, count_ = 0;
  uint8_t idle_every_ = 1;
};

}  // namespace takt::semantic
