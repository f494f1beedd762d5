// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/compose/spares.hpp"
#include "hal/settings/json.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/outage_log.hpp"
#include "rt/supervise/supervisor.hpp"

namespace takt::command {

/// Tells in the report what became of processes that died: an entry of "faults" each ({what, kind: "outage", process,
/// nodes, cause, at_s, back_s, down_s, chunks_freed, by_spare}; back_s is null if it never came back, else `phases_ms`
/// says when, after at_s, its successor was started, had composed its part, had joined the others, and ran), and for
/// each node "down", the planned releases that fell into an outage of its process. `tasks_of`: by process, indexes into
/// plan.tasks.
void add_outages(const OutageLog& log, const std::vector<std::string>& processes, const Plan& plan,
                 const std::vector<std::vector<size_t>>& tasks_of, const RunResult& result,
                 nlohmann::ordered_json& report);
/// ... and what the spares of processes cost and did.
void add_spares(const std::vector<std::string>& processes, const std::vector<graph::SpareChoice>& choices,
                const std::vector<graph::TakeoverRoom>& room, const Supervisor& supervisor,
                nlohmann::ordered_json& report);

}  // namespace takt::command
