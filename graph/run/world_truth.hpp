// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/expect/expectation_watch.hpp"

namespace takt::sim {
class Simulation;
}

namespace takt::command {

/// The truth of a simulated world, which outlives it; of none if that is null.
graph::WorldTruth world_truth(const sim::Simulation* world);

}  // namespace takt::command
