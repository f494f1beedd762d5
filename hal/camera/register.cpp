// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/iidc/iidc_driver.hpp"
#include "hal/camera/rig.hpp"
#include "hal/camera/stereo_camera_node.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "hal/camera/v4l2_driver.hpp"
#include "hal/driver_parts.hpp"
#include "hal/gpio/gpio_driver.hpp"

namespace takt::hal {

HealthThresholds thresholds_of(Settings& settings) {
  HealthThresholds t;
  t.step_px = static_cast<int>(settings.count("health_step", t.step_px, 1, 64));
  t.saturated_level = static_cast<int>(settings.count("saturated_level", t.saturated_level, 1, 256));
  t.saturated_fraction = settings.quantity("saturated_fraction", Dimension::number, t.saturated_fraction);
  t.dark_mean = settings.quantity("dark_mean", Dimension::number, t.dark_mean);
  t.blurred_gradient = settings.quantity("blurred_gradient", Dimension::number, t.blurred_gradient);
  t.unchanging_difference = settings.quantity("unchanging_difference", Dimension::number, t.unchanging_difference);
  return t;
}

namespace {

/// None without a `trigger_line`.
std::unique_ptr<v4l2::FrameTrigger> trigger_of(Settings& settings, const Clock& clock,
                                               std::unique_ptr<gpio::LineChip> seam) {
  v4l2::FrameTriggerSettings trigger;
  trigger.line = settings.text("trigger_line", "");
  trigger.chip = settings.text("trigger_chip", "/dev/gpiochip0");
  trigger.pulse_ns = pulse_ns(settings, "trigger_pulse");
  if (trigger.line.empty() && (settings.has("trigger_chip") || settings.has("trigger_pulse")))
    settings.fail("the trigger has no line", "add `trigger_line`, or leave `trigger_chip` and `trigger_pulse` out");
  if (trigger.line.empty()) return nullptr;
  return std::make_unique<v4l2::FrameTrigger>(std::move(trigger), chip_or(std::move(seam)), clock);
}

}  // namespace

tl::expected<v4l2::V4l2CameraSettings, DeviceError> read_camera(const DeviceConfig& config, Settings& settings) {
  v4l2::V4l2CameraSettings camera;
  const auto file = settings.path("rig", true);
  if (settings.error()) return tl::unexpected(*settings.error());
  auto rig = load_rig(config.id, file);
  if (!rig) return tl::unexpected(rig.error());
  camera.rig = *rig;
  const std::string format = settings.text("format", "y16"), bayer = settings.text("bayer", "none");
  if (const auto known = v4l2::frame_format(format)) camera.layout.format = *known;
  else settings.fail("`format` is `" + format + "`", "use y16, y8i, rgb3, yuyv or grey");
  if (const auto known = v4l2::mosaic(bayer)) camera.layout.mosaic = *known;
  else settings.fail("`bayer` is `" + bayer + "`", "use none, rggb, grbg, gbrg or bggr");
  const bool beside = camera.layout.side_by_side();
  camera.layout.left = static_cast<int>(settings.count("left", beside ? 0 : 1, 0, 2));
  camera.layout.right = static_cast<int>(settings.count("right", beside ? 1 : 0, 0, 2));
  camera.rate = rate_of(settings);
  camera.buffers = static_cast<uint32_t>(settings.count("buffers", camera.buffers, 2, v4l2::V4l2Camera::kMostBuffers));
  camera.exposure_s = settings.quantity("exposure", Dimension::time, camera.exposure_s);
  camera.longest_exposure_s = settings.quantity("longest_exposure", Dimension::time, camera.longest_exposure_s);
  camera.transfer_s = settings.quantity("transfer", Dimension::time, camera.transfer_s);
  camera.gain = settings.quantity("gain", Dimension::number, camera.gain);
  camera.stamp_delay_s = settings.quantity("stamp_delay", Dimension::time, camera.stamp_delay_s);
  if (settings.error()) return tl::unexpected(*settings.error());
  return camera;
}

NodeResult closed_camera(const DeviceConfig& config, Settings& settings, v4l2::V4l2CameraSettings camera,
                         const Clock& clock, std::unique_ptr<v4l2::VideoDevice> video,
                         std::unique_ptr<gpio::LineChip> chip) {
  auto device = std::make_unique<v4l2::V4l2Camera>(config.id, std::move(camera), std::move(video), clock,
                                                   trigger_of(settings, clock, std::move(chip)));
  if (const auto sound = device->check_settings(); !sound) return tl::unexpected(sound.error());
  return closed<StereoCameraNode>(std::move(device), settings, thresholds_of(settings));
}

NodeResult make_v4l2_camera(const DeviceConfig& config, Settings& settings, const Clock& clock,
                            std::unique_ptr<v4l2::VideoDevice> video, std::unique_ptr<gpio::LineChip> chip) {
  const auto path = settings.path("path", true);
  auto camera = read_camera(config, settings);
  if (!camera) return tl::unexpected(camera.error());
  camera->path = path.string();
  camera->dmabuf = settings.flag("dmabuf", camera->dmabuf);
  if (!video) video = std::make_unique<v4l2::KernelVideoDevice>();
  return closed_camera(config, settings, std::move(*camera), clock, std::move(video), std::move(chip));
}

std::vector<SettingInfo> camera_settings(std::string_view driver, const SettingInfo& place, const SettingInfo& more) {
  using enum SettingKind;
  return {
      place,
      {"rig", driver, path, true, "YAML file with lens, size, baseline and mount"},
      {"format", driver, text, false, "y16 (a Bumblebee), y8i, rgb3 (three sensors), yuyv or grey (side by side); y16"},
      {"left", driver, count, false, "byte of a pixel, or half of a row, of the left eye; 1, 0 side by side"},
      {"right", driver, count, false, "byte of a pixel, or half of a row, of the right eye; 0, 1 side by side"},
      {"bayer", driver, text, false, "rggb, grbg, gbrg or bggr: debayered to BGR; none (stereo debayers better)"},
      {"buffers", driver, count, false, "frames that wait in the kernel's driver; 4"},
      {"exposure", driver, time, false, "exposure time; as the camera is set"},
      {"longest_exposure", driver, time, false, "of an automatic exposure; a whole period of its rate"},
      {"transfer", driver, time, false, "from the end of the exposure until the frame is here; a whole period"},
      {"gain", driver, number, false, "gain in the camera's own steps; as the camera is set"},
      {"stamp_delay", driver, time, false, "from the begin of the exposure to the device's stamp; 0s"},
      {"trigger_line", driver, text, false,
       "output of a GPIO chip that makes it expose, one pulse a job; none: its rate"},
      {"trigger_chip", driver, path, false, "the chip of that line; /dev/gpiochip0", true},
      {"trigger_pulse", driver, time, false, "so long the line is high, at most 1ms; 0.1ms"},
      more,
  };
}

}  // namespace takt::hal

namespace takt {

void register_stereo_camera(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add(
      {"stereo_camera",
       "gives `pair`",
       [] { return std::make_unique<StereoCameraNode>(nullptr); },
       {},
       {
           {"health_step", "", count, false, "the health check looks at one pixel in n x n; 8"},
           {"saturated_level", "", count, false, "level from which a pixel is saturated; 250"},
           {"saturated_fraction", "", number, false, "share of saturated pixels that flags a frame; 0.05"},
           {"dark_mean", "", number, false, "mean level below which a frame is dark; 20"},
           {"blurred_gradient", "", number, false, "mean gradient below which a frame is blurred, levels per px; 1.5"},
           {"unchanging_difference", "", number, false,
            "mean difference to the frame before, below which it repeats; 0.25"},
       }});
  types.add("stereo_camera",
            {"v4l2", "a stereo camera behind Video4Linux",
             hal::hardware([](const hal::DeviceConfig& config, Settings& settings, hal::Devices&, const Clock& clock) {
               return hal::make_v4l2_camera(config, settings, clock, nullptr, nullptr);
             })},
            hal::camera_settings("v4l2", {"path", "v4l2", path, true, "device file, for instance /dev/video0", true},
                                 {"dmabuf", "v4l2", flag, false, "buffers are exported as DMABUFs for import; false"}));
  hal::add_iidc_camera(types);
}

}  // namespace takt
