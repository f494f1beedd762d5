// SPDX-License-Identifier: Apache-2.0
#include "hal/driver_parts.hpp"
#include "hal/interaction/console.hpp"
#include "hal/interaction/interaction_node.hpp"
#include "hal/interaction/make_web.hpp"
#include "hal/interaction/speaking.hpp"

namespace takt {
namespace {

using namespace hal;

NodeResult make_console(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  ConsoleSettings console;
  console.input = settings.text("input", console.input);
  console.output = settings.text("output", console.output);
  std::unique_ptr<Interaction> device = std::make_unique<Console>(config.id, std::move(console));
  device = with_speech(std::move(device), config, settings, clock);
  return closed<InteractionNode>(std::move(device), settings);
}

NodeResult make_web(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  return make_web_screen(config, settings, clock, nullptr);
}

}  // namespace

NodeResult hal::make_web_screen(const DeviceConfig& config, Settings& settings, const Clock& clock,
                                std::shared_ptr<AnswerLine> fingers) {
  std::unique_ptr<Interaction> device = std::make_unique<WebScreen>(std::move(fingers));
  device = with_speech(std::move(device), config, settings, clock);
  return closed<InteractionNode>(std::move(device), settings);
}

void register_interaction(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add({"interaction",
             "gives `task`, takes `speech`",
             [] { return std::make_unique<InteractionNode>(nullptr); },
             {},
             speech_settings()});
  types.add("interaction", {"console", "a terminal, a FIFO or a file", hardware(make_console)},
            {
                {"input", "console", text, false, "terminal, FIFO or file with one task a line; /dev/stdin", true},
                {"output", "console", text, false, "where it prints what is said; /dev/stdout", true},
            });
  types.add("interaction", {"web", "the robot's screen: the page of `takt web` under Touch", hardware(make_web)}, {});
}

}  // namespace takt
