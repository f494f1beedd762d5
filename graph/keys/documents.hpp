// SPDX-License-Identifier: Apache-2.0
// What the machines of a graph may do with each other, as the XML that DDS Security reads once it is signed.
#pragma once
#include <ctime>
#include <string>

#include "graph/language/graph.hpp"

namespace takt::keys {

/// The subject of the certificate of a machine: "CN=robot.two_machines".
std::string subject_of(const graph::GraphSpec& graph, const std::string& machine);

/// Who has no certificate is not heard, and all that goes out is encrypted: discovery and data.
/// Source: OMG DDS Security 1.1, section 9.4.1.2.
std::string governance(const graph::GraphSpec& graph);

/// A machine sends its own topics of this graph and reads those of the other machines, from `from` to `until` (UTC),
/// in the domain of the graph; nothing else. Source: section 9.4.1.3.
std::string permissions(const graph::GraphSpec& graph, const std::string& machine, std::time_t from, std::time_t until);

/// "2031-11-30T12:00:00Z"
std::string utc(std::time_t time);

}  // namespace takt::keys
