// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/camera/health.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "hal/camera/video_device.hpp"
#include "hal/devices.hpp"
#include "hal/gpio/line_chip.hpp"

namespace takt::hal {

/// The driver `v4l2`, closed, on that device and the chip of its trigger; null: the kernel's.
NodeResult make_v4l2_camera(const DeviceConfig& config, Settings& settings, const Clock& clock,
                            std::unique_ptr<v4l2::VideoDevice> video, std::unique_ptr<gpio::LineChip> chip);

/// What the settings say of any camera that is read as a V4L2 device is: all but where it is.
tl::expected<v4l2::V4l2CameraSettings, DeviceError> read_camera(const DeviceConfig& config, Settings& settings);
/// Its node, closed, with the trigger that the settings ask for.
NodeResult closed_camera(const DeviceConfig& config, Settings& settings, v4l2::V4l2CameraSettings camera,
                         const Clock& clock, std::unique_ptr<v4l2::VideoDevice> video,
                         std::unique_ptr<gpio::LineChip> chip);
/// Those settings, as they are listed for a driver, with the one that says where it is, and another of its own.
std::vector<SettingInfo> camera_settings(std::string_view driver, const SettingInfo& place, const SettingInfo& more);

/// What every stereo camera's images are judged by.
HealthThresholds thresholds_of(Settings& settings);

}  // namespace takt::hal
