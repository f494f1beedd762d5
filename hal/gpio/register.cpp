// SPDX-License-Identifier: Apache-2.0
#include "hal/driver_parts.hpp"
#include "hal/gpio/gpio_driver.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "hal/gpio/lines_node.hpp"
#include "hal/gpio/pulse.hpp"

namespace takt::hal {

int64_t pulse_ns(Settings& settings, const char* name) {
  return time_ns(settings, name, 0.0001, static_cast<double>(gpio::kLongestPulse_ns) * 1e-9);
}

std::unique_ptr<gpio::LineChip> chip_or(std::unique_ptr<gpio::LineChip> seam) {
  return seam ? std::move(seam) : std::make_unique<gpio::KernelLineChip>();
}

NodeResult make_gpio_lines(const DeviceConfig& config, Settings& settings, const Clock& clock,
                           std::unique_ptr<gpio::LineChip> chip) {
  gpio::GpioLinesSettings lines;
  lines.chip = settings.path("chip", true).string();
  lines.inputs = list_of(settings, "inputs", "0");
  lines.outputs = list_of(settings, "outputs", "");
  lines.powered = list_of(settings, "powered", "");
  lines.trigger = settings.text("trigger", "");
  lines.debounce_ns = time_ns(settings, "debounce", 0.005, 1.0);
  lines.pulse_ns = pulse_ns(settings, "pulse");
  std::unique_ptr<DigitalLines> device =
      std::make_unique<gpio::GpioLines>(config.id, std::move(lines), chip_or(std::move(chip)), clock);
  return closed<LinesNode>(std::move(device), settings);
}

}  // namespace takt::hal

namespace takt {

void register_digital_lines(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add({"digital_lines", "gives `state`", [] { return std::make_unique<LinesNode>(nullptr); }, {}, {}});
  types.add(
      "digital_lines",
      {"gpio", "lines of a GPIO chip",
       hal::hardware([](const hal::DeviceConfig& config, Settings& settings, hal::Devices&, const Clock& clock) {
         return hal::make_gpio_lines(config, settings, clock, nullptr);
       })},
      {
          {"chip", "gpio", path, true, "device file of the chip, for instance /dev/gpiochip0", true},
          {"inputs", "gpio", text, false, "names or offsets of the inputs, the emergency stop first: estop, 5; 0"},
          {"outputs", "gpio", text, false, "names or offsets of outputs, low until they are written; none"},
          {"powered", "gpio", text, false,
           "outputs that are high from the start to the stop, such as eyelid_power; none"},
          {"trigger", "gpio", text, false, "output with a pulse at each release; none"},
          {"debounce", "gpio", time, false, "a rise of an input counts after so long, a fall at once; 5ms"},
          {"pulse", "gpio", time, false, "how long the trigger is high, at most 1ms; 0.1ms"},
      });
}

}  // namespace takt
