// SPDX-License-Identifier: Apache-2.0
#include "graph/main.hpp"

#include "graph/ace/ace_registry.hpp"
#include "graph/command/robot/robot_commands.hpp"

int main(int argc, char** argv) {
  const auto fill = [](takt::Registry& registry) { registry = takt::ace_registry(); };
  return takt::main(argc, argv, fill, takt::command::add_robot_commands);
}
