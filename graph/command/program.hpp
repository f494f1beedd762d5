// SPDX-License-Identifier: Apache-2.0
// The command line of Takt as a function.
#pragma once
#include <functional>
#include <memory>

namespace CLI {
class App;
}

namespace takt::command {

/// Adds commands to the program. A command that was chosen sets the exit code when it has run. What is returned lives
/// as long as the program: the places of the commands' options.
using MoreCommands = std::function<std::shared_ptr<void>(CLI::App& app, int& exit_code)>;

/// The whole of main(): returns the exit code. To be called once, at the begin of main(), before any thread is made.
int run_program(int argc, char** argv, const MoreCommands& more);

}  // namespace takt::command
