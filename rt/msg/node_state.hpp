// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/node_state.hpp>: core, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"

namespace takt {

/// What a node remembers behind a job (rt/state_archive.hpp), for a replay that begins there. Capacity: count (bytes).
struct NodeState {
  static constexpr std::string_view type_name = "node_state";
  uint64_t layout = 0;  ///< StateArchive::layout() of the node as set up; 0: it did not fit, and there is nothing
  Array<uint8_t> bytes;
  TAKT_FIELDS(NodeState, (layout, ""), (bytes, ""))
};

}  // namespace takt
