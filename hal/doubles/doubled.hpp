// SPDX-License-Identifier: Apache-2.0
// Driver `double`: the driver of real hardware, with a double of the device at the other end of its line.
#pragma once
#include <memory>
#include <string>

#include "hal/camera/video_device.hpp"
#include "hal/devices.hpp"
#include "hal/double_thread.hpp"
#include "hal/gpio/line_chip.hpp"
#include "hal/interaction/web.hpp"
#include "hal/sim/simulation.hpp"

namespace takt::hal {

/// What stands in for the kernel under a driver; null: the kernel itself.
struct Seams {
  std::unique_ptr<v4l2::VideoDevice> video;
  std::unique_ptr<gpio::LineChip> chip;
  std::shared_ptr<AnswerLine> fingers;
};

/// A double, and how its driver finds it. `config` and `seams` are the driver's; nothing of them may outlive `thread`.
struct Doubled {
  DeviceConfig config;
  std::unique_ptr<DoubleThread> thread;
  Seams seams;
  /// Makes the driver, closed.
  NodeResult (*driver)(const DeviceConfig&, Settings&, Devices&, const Clock&, Seams) = nullptr;
};

/// The double of that device in that world, plugged in. Lines that need a file have it in `folder`.
tl::expected<Doubled, DeviceError> make_double(const DeviceConfig& config, Settings& settings, sim::Simulation& world,
                                               const std::filesystem::path& folder, const Clock& clock);

}  // namespace takt::hal
