// SPDX-License-Identifier: Apache-2.0
// The shipped JSON Schemas (graph/schema, embedded at build time) and what they say of a document, in our words.
#pragma once
#include <string>
#include <vector>

#include "graph/language/document.hpp"

namespace takt::graph {

enum class Schema : uint8_t { graph, schedule, faults, params, machine };
inline constexpr size_t kSchemas = 5;

/// The schema's text as it is shipped to editors.
std::string_view schema_text(Schema schema);

/// Appends one problem per place that breaks the schema; returns true if there is none.
bool validate(const Document& document, Schema schema, std::vector<Problem>& problems);

/// The verdict of valijson alone; tests compare it with ours.
bool valid_by_library(const nlohmann::json& value, Schema schema);

}  // namespace takt::graph
