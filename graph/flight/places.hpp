// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"
#include "rt/record/recorder.hpp"

namespace takt::flight {

/// What the ring keeps of each port, and where: small messages with all fields on disk; of images and clouds their
/// hashes on disk, and of those of devices, and where the graph asks for it, all fields in memory. Large states of
/// nodes are in both, on disk one now and then.
struct Places {
  std::vector<record::PortRule> disk, memory;   ///< by port
  double disk_bytes_s = 0, memory_bytes_s = 0;  ///< at most, from the ports' capacities and rates
  int64_t states_ns = 0;                        ///< the longest pause between two states of a node on disk
  bool in_memory() const;                       ///< at least one port is
};

/// A port that can give more than this lies in memory.
inline constexpr double kMostOnDisk = 1e6;  ///< bytes a second

Places places(const graph::RecordSpec& spec, const Plan& plan);

/// So much before the time that is asked for lies in a frozen file: a snapshot of each task that has a job a second,
/// and one before it for those whose messages others need from there on.
int64_t lead_ns(const graph::RecordSpec& spec);

/// The graph's rule for that output; null: it has none.
const record::PortRule* rule_of(const graph::RecordSpec& spec, const PortPlan& port);

/// Of the memory asked for, what leaves others as much of /dev/shm as is free; 0: less than a ring needs.
int64_t memory_to_use(const graph::RecordSpec& spec);

/// Where these sizes do not suffice for these times, or the file systems for these sizes: a sentence each.
std::vector<std::string> doubts(const graph::RecordSpec& spec, const Places& places,
                                const std::filesystem::path& folder);

/// What a ring of that graph takes and keeps: lines of `takt check`, and its key `ring`.
std::string ring_text(const graph::RecordSpec& spec, const Plan& plan, const std::filesystem::path& folder);
nlohmann::ordered_json ring_json(const graph::RecordSpec& spec, const Plan& plan, const std::filesystem::path& folder);

}  // namespace takt::flight
