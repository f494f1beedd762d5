// SPDX-License-Identifier: Apache-2.0
// The commands that only a robot's program has: `takt robot | devices | capture | double`.
#pragma once
#include <memory>

namespace CLI {
class App;
}

namespace takt::command {

/// Adds them; what is returned holds their options (takt::MoreCommands).
std::shared_ptr<void> add_robot_commands(CLI::App& app, int& exit_code);

}  // namespace takt::command
