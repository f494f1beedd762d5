// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/requests.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"

namespace takt {

/// What one node is asked to do: run at every n-th of its releases, or not at all.
struct Request {
  using scalar = uint8_t;
  char node[30] = {};  ///< id in the graph, ended by 0
  uint8_t run = 1;     ///< 0: stop
  uint8_t every = 1;   ///< pace; 1: each release
};

/// The whole of what a clock generator asks for at present; a node that is not named runs at its full rate. State and
/// not events, so that a message more or less changes nothing. Capacity: count.
struct Requests {
  static constexpr std::string_view type_name = "requests";
  Array<Request> wanted;
  TAKT_FIELDS(Requests, (wanted, ""))
};

}  // namespace takt
