// SPDX-License-Identifier: Apache-2.0
#include "hal/driver_parts.hpp"
#include "hal/interaction/console.hpp"
#include "hal/interaction/interaction_node.hpp"

namespace takt {
namespace {

using namespace hal;

NodeResult make_console(const DeviceConfig& config, Settings& settings, Devices&, const Clock&) {
  ConsoleSettings console;
  console.input = settings.text("input", console.input);
  console.output = settings.text("output", console.output);
  std::unique_ptr<Interaction> device = std::make_unique<Console>(config.id, std::move(console));
  return closed<InteractionNode>(std::move(device), settings);
}

}  // namespace

void register_interaction(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add({"interaction",
             "gives `task`, takes `speech`",
             [] { return std::make_unique<InteractionNode>(nullptr); },
             {},
             {}});
  types.add("interaction", {"console", "a terminal, a FIFO or a file", hardware(make_console)},
            {
                {"input", "console", text, false, "terminal, FIFO or file with one task a line; /dev/stdin"},
                {"output", "console", text, false, "where it prints what is said; /dev/stdout"},
            });
}

}  // namespace takt
