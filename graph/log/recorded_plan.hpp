// SPDX-License-Identifier: Apache-2.0
// What a record says of the graph it was made of, beside the text of its files: enough to see whether a graph of today
// is still the same one.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hal/settings/json.hpp"
#include "rt/record/recorded_event.hpp"
#include "rt/sched/plan.hpp"

namespace takt::log {

using Json = nlohmann::ordered_json;

/// Tasks with edges, outputs and parameters, ports with types and capacities, modes.
Json plan_json(const Plan& plan);

/// Why jobs of the recorded plan cannot be run by this one: the first thing in which they differ, parameters apart.
/// Nothing if they can.
std::optional<std::string> structure_differs(const Json& recorded, const Json& plan);

/// Parameters that are not as they were: "stereo.window is 9 instead of 15".
std::vector<std::string> changed_params(const Json& recorded, const Json& plan);

/// Capacity of port `index` in a recorded plan. Throws nlohmann's exception if the record does not say.
Capacity capacity_of(const Json& recorded, size_t index);

/// An event in words: "restart before job 26", "bias set to 0.25"; names are those of the plan, as far as it has them.
std::string event_text(const record::RecordedEvent& event, const Json& plan);
/// The node that it happened to; empty: none.
std::string event_node(const record::RecordedEvent& event, const Json& plan);

/// Where each file or folder is that a parameter of the plan's nodes names (kPath); by the name that a record has for
/// it (graph/language/share.hpp).
std::map<std::string, std::filesystem::path> assets(const Plan& plan, const std::filesystem::path& directory);

/// Hashes of these, as hexadecimal digits; none of what is not there. A folder is all files below it, by name.
Json asset_hashes(const Plan& plan, const std::filesystem::path& directory);

/// Name in a record of file `i` of GraphSpec::files, i > 0: "part_1.yaml".
std::string part_name(size_t i);

/// Hash of a file, as hexadecimal digits; that of nothing if it cannot be read.
std::string file_hash(const std::filesystem::path& file);

/// Hash of this program and of the libtakt_core that it runs with: jobs are the work of both.
std::string program_hash();

/// All of a file; empty if it cannot be read.
std::string file_text(const std::filesystem::path& file);

}  // namespace takt::log
