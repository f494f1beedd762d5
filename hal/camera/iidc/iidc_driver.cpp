// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/iidc/iidc_driver.hpp"

#include <charconv>

#include "hal/camera/iidc/iidc_video_device.hpp"
#include "hal/camera/v4l2_driver.hpp"
#include "hal/driver_parts.hpp"

namespace takt::hal {
namespace {

/// 16 hexadecimal digits, as `takt devices` prints them; 0: not given.
uint64_t guid_of(Settings& settings) {
  const std::string text = settings.text("guid", "");
  uint64_t guid = 0;
  const char* end = text.data() + text.size();
  if (!text.empty() && (text.size() != 16 || std::from_chars(text.data(), end, guid, 16).ptr != end || guid == 0))
    settings.fail("`guid` is `" + text + "`",
                  "use the 16 digits that `takt devices` prints, such as \"00b09d0100a1b2c3\"");
  return guid;
}

iidc::IidcSettings iidc_of(Settings& settings) {
  iidc::IidcSettings bus;
  bus.guid = guid_of(settings);
  const std::string eyes = settings.text("eyes", "as they are"), edge = settings.text("trigger_edge", "rising");
  if (eyes == "wide") bus.eyes = iidc::Eyes::wide;
  else if (eyes == "narrow") bus.eyes = iidc::Eyes::narrow;
  else if (settings.has("eyes")) settings.fail("`eyes` is `" + eyes + "`", "use wide or narrow");
  if (edge != "rising" && edge != "falling") settings.fail("`trigger_edge` is `" + edge + "`", "use rising or falling");
  bus.falling = edge == "falling";
  bus.triggered = settings.has("trigger_line");
  if (settings.has("trigger_edge") && !bus.triggered)
    settings.fail("the trigger has no line", "add `trigger_line`, or leave `trigger_edge` out");
  return bus;
}

}  // namespace

NodeResult make_iidc_camera(const DeviceConfig& config, Settings& settings, const Clock& clock,
                            const iidc::Dc1394Calls* calls, std::unique_ptr<gpio::LineChip> chip) {
  const iidc::IidcSettings bus = iidc_of(settings);
  auto camera = read_camera(config, settings);
  if (!camera) return tl::unexpected(camera.error());
  if (camera->layout.format != v4l2::FrameFormat::y16 && camera->layout.format != v4l2::FrameFormat::rgb3)
    settings.fail("`format` is none of an IIDC camera", "use y16 (two sensors) or rgb3 (three)");
  camera->path = bus.guid == 0 ? "the FireWire camera" : "FireWire camera " + settings.text("guid", "");
  // Its stamps are of the end of the exposure.
  if (!settings.has("stamp_delay")) camera->stamp_delay_s = camera->exposure_s;
  return closed_camera(config, settings, std::move(*camera), clock,
                       std::make_unique<iidc::IidcVideoDevice>(bus, calls, clock), std::move(chip));
}

void add_iidc_camera(DeviceTypes& types) {
  using enum SettingKind;
  const auto make = [](const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
    const auto calls = iidc::load_dc1394();
    return make_iidc_camera(config, settings, clock, calls ? *calls : nullptr, nullptr);
  };
  auto settings =
      camera_settings("iidc", {"guid", "iidc", text, false, "16 hexadecimal digits of the camera; the only one", true},
                      {"trigger_edge", "iidc", text, false, "rising or falling edge of its pin 0; rising", true});
  settings.push_back({"eyes", "iidc", text, false,
                      "wide or narrow: which two of three sensors (register PAN); as the camera is set", true});
  types.add("stereo_camera", {"iidc", "a stereo camera on FireWire, such as a Bumblebee (libdc1394)", hardware(make)},
            std::move(settings));
}

}  // namespace takt::hal
