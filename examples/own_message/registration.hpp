// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <takt/registry.hpp>

#include "nodes.hpp"

inline void register_kitchen(takt::Registry& registry) {
  registry.nodes.add<Oven>("oven", takt::Layer::sensor, "a temperature that rises");
  registry.nodes.add<Alarm>("alarm", takt::Layer::perception, "passes on temperatures above a limit");
}
