// SPDX-License-Identifier: Apache-2.0
#include "graph/command/program.hpp"
#include "graph/command/robot/robot_commands.hpp"

int main(int argc, char** argv) { return takt::command::run_program(argc, argv, takt::command::add_robot_commands); }
