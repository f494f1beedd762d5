// SPDX-License-Identifier: Apache-2.0
// What a program knows that has a node with a port for grids and one for odometry.
#pragma once
#include "graph/language/message_types.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"

namespace takt::test {

inline graph::MessageTypes known_types() {
  return {{"grid", &MessageType::of<Grid>()}, {"odometry", &MessageType::of<Odometry>()}};
}

}  // namespace takt::test
