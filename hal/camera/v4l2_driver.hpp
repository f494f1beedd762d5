// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/camera/health.hpp"
#include "hal/camera/video_device.hpp"
#include "hal/devices.hpp"
#include "hal/gpio/line_chip.hpp"

namespace takt::hal {

/// The driver `v4l2`, closed, on that device and the chip of its trigger; null: the kernel's.
NodeResult make_v4l2_camera(const DeviceConfig& config, Settings& settings, const Clock& clock,
                            std::unique_ptr<v4l2::VideoDevice> video, std::unique_ptr<gpio::LineChip> chip);

/// What every stereo camera's images are judged by.
HealthThresholds thresholds_of(Settings& settings);

}  // namespace takt::hal
