// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/main.hpp>: graph, experimental.
// A program of your own with all commands of Takt: run, check, nodes, replay, top ...
//
//   int main(int argc, char** argv) {
//     return takt::main(argc, argv, [](takt::Registry& registry) { register_blink(registry.nodes); });
//   }
//
// It knows what its function registers and nothing else. The stock `takt` is such a program, with the nodes, devices
// and commands of the robot ACE. The same function in a plug-in (graph/plugin.hpp) needs no program.
#pragma once
#include <functional>
#include <memory>

#include "graph/language/registry.hpp"

namespace CLI {
class App;
}

namespace takt {

/// Adds commands to those of Takt. A command that was chosen sets the exit code when it has run. What is returned lives
/// as long as the program does: it holds the options.
using MoreCommands = std::function<std::shared_ptr<void>(CLI::App& app, int& exit_code)>;

/// All of main(): returns the exit code (0 done, 1 not as asked, 2 bad input, 3 a device or the system). Once a
/// process, before any thread is made. What `fill` throws is an error of the program, with exit code 2.
int main(int argc, char** argv, const std::function<void(Registry&)>& fill, const MoreCommands& more = {});

}  // namespace takt
