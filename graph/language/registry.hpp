// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/registry.hpp>: graph, experimental.
#pragma once
#include "hal/device_types.hpp"
#include "rt/node.hpp"

namespace takt {

/// What a program knows: its node types and devices. Everything that reads or runs a graph takes one.
///
///     Registry registry = ace_registry();
///     registry.nodes.add<Blinker>("blinker", Layer::processing, "blinks");
///     const graph::Loaded loaded = graph::load("my.yaml", {}, registry);
///
/// A value, filled before its first use and not changed after; it outlives what was made with it. Reading it is safe
/// in any thread.
struct Registry {
  NodeTypes nodes;
  hal::DeviceTypes devices;
};

}  // namespace takt
