// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fmt/format.h>

#include <string>

#include "graph/command/top/watched.hpp"

namespace takt::top::test {

/// A run with all that pages show: long and short names, figures from 0 to twelve digits, late jobs, texts in UTF-8.
inline Watched generated_run(size_t nodes = 26) {
  Watched run;
  run.graph = "ace";
  run.profile = "sim";
  run.policy = "deadline";
  run.mode = "full";
  run.heard = true;
  run.running_s = 12.5;
  for (size_t n = 0; n < nodes; ++n) {
    NodeSeen& node = run.nodes.emplace_back();
    node.name = n % 3 == 0 ? fmt::format("n{}", n) : fmt::format("a_node_with_a_rather_long_name_{}", n);
    node.process = "mapping";
    node.criticality = n % 2 == 0 ? "high" : "low";
    node.device = n % 5 == 0;
    node.deadline_ms = 66.667;
    if (n % 4 != 0) node.rate_hz = 15, node.budget_ms = 12, node.proven_ms = 60.1;
    node.levels = n % 2 == 0 ? 3 : 1;
    node.level = n % 2 == 0 ? 1 : 0;
    node.completed = n == 1 ? 123'456'789'012 : 187;
    node.deadline_misses = n == 1 ? 123'456 : 0;
    node.exec_ms = n == 2 ? 12.5 : 5.77;
    node.response_ms = n == 1 ? 123'456.7 : 25.2;
    node.response_max_ms = n == 1 ? 123'456.7 : 31.0;
    for (int j = 0; j < 150; ++j) {
      const double release_s = 2.5 + j / 15.0;
      node.jobs.push_back({release_s, release_s + 0.001, release_s + (n == 1 && j == 75 ? 0.08 : 0.02)});
    }
    node.jobs_unseen = n == 4;
  }
  run.chains = {{"stop", "front_laser.scan", "obstacle_stop.command", 150, 120.5, 61.2, 80.3},
                {"a_chain_with_a_name", "a_device.with_output", "a_node.with_output", 700, 599.2, 610.0, 650.5},
                {"unproven", "a.b", "c.d", 12345678.9, std::nullopt, std::nullopt, std::nullopt}};
  run.devices = {{"front_laser", "ok", "", 0, 812, 0, 0, 0, 0},
                 {"head_camera", "lost", "no frame for 200 ms; is the cable in?", 3, 1'234'567'890, 17, 4, 5, 6}};
  run.processes = {{"supervisor", "running", 4711, 0, 0.01, 30.5},
                   {"mapping", "composed", 4713, 2, std::nullopt, 1250.0}};
  run.use = {0.61, 921.0, 10, {}};
  run.parameters = {"cruise.speed 0.2 m/s (set at 3.1 s, taken up once after a restart)"};
  run.events = {{0.5, "mode", "", "full: the start"},
                {3.1, "parameter", "cruise", "speed is 0.2 m/s"},
                {4.0, "mark", "", "er bog in die Tür; 門 \x1b[31m and \xff"},
                {5.0, "fault", "a_node_with_a_rather_long_name_1",
                 "missed its deadline by 13.3 ms: it waited 60 ms for its turn behind stereo, which took 70 ms"}};
  return run;
}

/// A line without its styles.
inline std::string text_of(const Line& line) {
  std::string text;
  for (const Piece& piece : line) text += piece.text;
  return text;
}

}  // namespace takt::top::test
