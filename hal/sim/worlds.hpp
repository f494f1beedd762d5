// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/devices.hpp"
#include "hal/sim/simulation.hpp"

namespace takt::sim {

/// The world of a simulated device, as its settings `world` and `client` say: one per world file and seed in a process,
/// with one robot for each client that a device names.
tl::expected<Simulation*, DeviceError> world_of(const hal::DeviceConfig& config, hal::Devices& devices);

/// The simulation of the first client of these devices, or null.
Simulation* first_world(hal::Devices& devices);

/// Whether the base of the world drives its path or obeys, as the setting `drive` says.
void choose_drive(Settings& settings, Simulation& world);

}  // namespace takt::sim
