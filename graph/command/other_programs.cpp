// SPDX-License-Identifier: Apache-2.0
#include "graph/command/other_programs.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "graph/cli/other_program.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/language/words.hpp"

namespace takt::command {
namespace {

constexpr DeskCommand kDeskCommands[] = {
    {"bench", "measures the runtime and the algorithms against references", "takt-bench"},
    {"calibrate", "measures cameras and lasers from recordings", "takt-tools"},
    {"cloud", "filters point clouds in PLY and PCD files", "takt-tools"},
    {"eval", "measures quality against ground truth", "takt-eval"},
    {"image", "builds, tries, writes and updates machines that boot into a graph", "takt"},
    {"objects", "the database of known objects: what is in it, learning, tuning", "takt-tools"},
    {"ros2", "publishes a running graph to ROS 2", "takt-ros2"},
    {"terrain", "kinds of terrain that ground_map tells apart", "takt-tools"},
    {"train", "learns what nodes look for", "takt-tools"},
    {"web", "shows a running graph in a browser and to Foxglove", "takt-web"},
};

}  // namespace

std::span<const DeskCommand> desk_commands() { return kDeskCommands; }

int become_other_program(char** arguments, std::vector<std::string> own) {
  const std::string name = arguments[1];
  if (const auto program = other_program(name); !program.empty()) {
    std::string first = program.string();
    arguments[1] = first.data();  // which the program takes for its name
    execv(program.c_str(), arguments + 1);
    return refuse(fmt::format("{} cannot be started: {}", program.string(), std::strerror(errno)), kDeviceOrSystem);
  }
  const auto* desk = std::find_if(std::begin(kDeskCommands), std::end(kDeskCommands),
                                  [&](const DeskCommand& command) { return command.name == name; });
  if (desk != std::end(kDeskCommands))
    return refuse(fmt::format("takt-{0} is neither in libexec/takt, nor next to this program, nor in PATH\n"
                              "  fix: `./takt {0}` of a checkout builds it (target {1})",
                              name, desk->target),
                  kDeviceOrSystem);
  for (const DeskCommand& command : kDeskCommands) own.emplace_back(command.name);
  return refuse(
      fmt::format("there is no command `{0}`, and no program takt-{0} in libexec/takt, next to this program or "
                  "in PATH{1}",
                  name, graph::alternatives(name, std::move(own), "commands are")),
      kBadInput);
}

}  // namespace takt::command
