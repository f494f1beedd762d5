// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/expect/expectation_watch.hpp"
#include "hal/simulated.hpp"

namespace takt::command {

/// The truth of a simulated world, which outlives it; of none if that is null.
graph::WorldTruth world_truth(const hal::SimulatedWorld* world);

}  // namespace takt::command
