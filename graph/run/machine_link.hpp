// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "graph/language/registry.hpp"
#include "graph/machines/link.hpp"
#include "rt/own_thread.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/shm/transport.hpp"

namespace takt::command {

/// The link of the part of a graph that one machine runs, in its process kLinkProcess, before that composes. Throws
/// std::runtime_error: there is no network to run over. Graph, board and clock outlive it.
/// `set`: what the command line sets, the same on all machines. `run`: the process that stands for the run.
std::unique_ptr<machines::Link> make_link(const graph::GraphSpec& graph, const Registry& registry,
                                          const std::vector<std::string>& set, RunBoard& board, int run,
                                          const Clock& clock);

/// Carries questions: those that the run has for other machines, from its socket to the link. In the process of the
/// link, which outlives it.
class Courier {
 public:
  /// `run`: the process that stands for the run.
  Courier(machines::Link& link, int run);

 private:
  OwnThread thread_;
};

/// Puts the threads of this process but the calling one at kLowestPriority, as far as the kernel allows: those of the
/// link and of its DDS, before there are others. Ordinary load then keeps no message waiting; lanes do.
void lift_other_threads();

/// Once the messages of this machine can be read.
void begin(machines::Link& link, const graph::GraphSpec& graph, const Plan& plan, Transport& transport);

}  // namespace takt::command
