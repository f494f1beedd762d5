// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/compose/partition.hpp"
#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Whether a process of a run has a spare: a second process with its part composed, which takes its place when it dies.
struct SpareChoice {
  bool wanted = false;
  std::string why;  ///< "chain stop allows 200 ms, a return without a spare takes 300"
};

/// How long a process is away without a spare, from kill to first publication: what its readers' ages must allow.
inline constexpr int64_t kReturn_ns = 300'000'000;

/// By process of the partition. A process has a spare where its subsystem says so (`spare`), by default where it lies
/// on a chain that ends in a node of high criticality and allows less than kReturn_ns. One that owns devices never has:
/// they cannot be opened twice; where one was asked for, `adjusted` says so.
std::vector<SpareChoice> spares(const GraphSpec& graph, const Partition& partition, std::vector<std::string>& adjusted);

/// SCHED_DEADLINE bandwidth that the workers of a process ask for when it comes back, and what is free beside all that
/// the plan reserves, in cores. The dead process holds its own for up to a period more. What is not free then does not
/// keep the process away: its jobs run under SCHED_FIFO until the kernel grants it.
struct TakeoverRoom {
  double needs = 0, free = 0;
  bool fits() const { return needs <= free; }
};
/// By process; empty under another policy than `deadline`. `limit`: cores that the kernel reserves in all.
std::vector<TakeoverRoom> takeover_room(const Plan& plan, const Partition& partition, double limit);

/// "spare of process robot: why; ..." a line for each process with a spare, and for the others the one with the largest
/// need that is not free.
std::string spares_text(const Partition& partition, const std::vector<SpareChoice>& choices,
                        const std::vector<TakeoverRoom>& room);
/// [{process, spare, why, needs_cores, free_cores}]; the last two under `deadline` only.
nlohmann::ordered_json spares_json(const Partition& partition, const std::vector<SpareChoice>& choices,
                                   const std::vector<TakeoverRoom>& room);

}  // namespace takt::graph
