// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/assembly.hpp>: core, stable.
// Nodes of one process put together in code, without a graph file:
//
//   takt::Assembly robot;
//   auto& camera = robot.add<Camera>("camera", {.rate = takt::Rate{15, 1}});
//   auto& finder = robot.add<Finder>("finder", {.deadline_ns = 40'000'000});
//   robot.connect(camera.picture, finder.picture, {.triggers = true});  // a job of finder for each picture
//   robot.run({.duration_ns = 10'000'000'000});
//
// A graph file offers more (checks of ages, isolation, records, faults): package `graph`.
#pragma once
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "rt/node.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt {

/// When the jobs of a node run. Times in ns.
struct Pace {
  std::optional<Rate> rate = {};         ///< none: one of its inputs triggers it
  int64_t offset_ns = 0;                 ///< from the start of the run to the first release
  int64_t deadline_ns = 0;               ///< after each release; 0: the period, or 100 ms where an input triggers
  std::filesystem::path directory = {};  ///< where relative paths of the node start; empty: the current one
};

/// How an input takes what an output sends.
struct Link {
  uint32_t depth = 1;      ///< so many of the newest messages, 1 to InputPort::kMaxDepth
  bool triggers = false;   ///< each message releases a job of the reader
  int64_t max_age_ns = 0;  ///< an older one counts as stale; 0: none does
};

/// How long and in which time an assembly runs.
struct RunFor {
  int64_t duration_ns = 0;    ///< 0: until stop() or the end of a device's data
  bool virtual_time = false;  ///< time jumps from release to release, and runs give the same results each time
};

/// Nodes and their links. Used by one thread; stop() by any. A wrong use (an unknown port, a taken name, a rate and a
/// trigger) throws std::invalid_argument with the names at fault; what a node refuses in setup() throws SetupError.
class Assembly {
 public:
  Assembly();
  ~Assembly();
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;

  /// A node of this assembly, which lives as long. `name` is that of its messages and errors.
  template <std::derived_from<Node> T, class... Args>
  T& add(const std::string& name, const Pace& pace, Args&&... args) {
    auto node = std::make_unique<T>(std::forward<Args>(args)...);
    T& added = *node;
    insert(name, pace, std::move(node));
    return added;
  }

  /// From now on `to` reads `from`. Both are of nodes of this assembly and of one message type.
  template <class T>
  void connect(const Output<T>& from, const Input<T>& to, const Link& link = {}) {
    join(from, to, link);
  }

  /// Sets the nodes up, runs their jobs and finishes the nodes. Once per assembly. Throws std::runtime_error with the
  /// fix if the machine lacks memory, and if a job never returns: its nodes then stay in memory until the process ends.
  void run(const RunFor& how = {});

  /// Ends the run: no release after this instant. Any thread, also a signal handler; before run() it does nothing.
  void stop();

 private:
  void insert(const std::string& name, const Pace& pace, std::unique_ptr<Node> node);
  void join(const OutputPort& from, const InputPort& to, const Link& link);
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace takt
