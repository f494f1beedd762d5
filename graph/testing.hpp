// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/graph_testing.hpp>: graph, experimental.
// Runs a whole graph in virtual time, for the tests of a graph, in any test framework.
//
//   takt::GraphTest test("hello.yaml", registry);  // what the program knows: graph/language/registry.hpp
//   test.watch("doubler.out");
//   CHECK(test.run_for(2.0) == 0);  // seconds of virtual time; 0 is the exit code of `takt run`
//   CHECK(test.count("doubler.out") == 20);
//   CHECK(test.message<Number>("doubler.out", 19).value == 38);
//   CHECK(test.figure("nodes/doubler/deadline_misses") == 0);
//
// The run is that of `takt run GRAPH --clock virtual`: the same loading, checks, devices (profile), latching and
// report. It needs no privilege, and gives the same result each time. It prints
// nothing; what is wrong with the graph is on stderr. A wrong use (no such port or figure) throws std::logic_error with
// the valid choices. One thread at a time.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "rt/msg/field.hpp"

namespace takt {

struct Registry;

class GraphTest {
 public:
  /// `registry` lives longer than the test.
  GraphTest(std::filesystem::path graph, const Registry& registry);
  ~GraphTest();
  GraphTest(const GraphTest&) = delete;
  GraphTest& operator=(const GraphTest&) = delete;

  // Before the run; as the options of `takt run`.

  void profile(std::string name);
  void schedule(std::filesystem::path file);
  void mode(std::string name);
  /// "node.param=value"
  void set(std::string setting);
  /// A scenario of faults; run_for() then returns 0 exactly if what it expects is met.
  void faults(std::filesystem::path scenario);
  void seed(uint64_t value);
  /// Folder for what nodes write at the end (default: none is kept).
  void output(std::filesystem::path folder);
  /// Keeps every message of this output, "NODE.PORT".
  void watch(std::string port);

  /// Runs the graph once from its start, for so many seconds of virtual time. Returns the exit code of `takt run`: 0 if
  /// the run was as it should be, 1 if not or not admitted, 2 if the input is wrong, 3 for a device or the machine.
  /// Again: a new run; messages and report are those of the last one.
  int run_for(double seconds);

  // After the run.

  /// How many messages the output sent.
  size_t count(std::string_view port) const;
  /// Message i, the oldest is 0; valid until the next run.
  template <class M>
  const M& message(std::string_view port, size_t i) const {
    return *static_cast<const M*>(message(port, i, MessageType::of<M>()));
  }
  int64_t stamp_ns(std::string_view port, size_t i) const;
  /// A number of the report (true and false are 1 and 0), by the keys on the way to it: "duration_s",
  /// "nodes/NODE/completed", "chains/CHAIN/age_ms/max", "edges/FROM -> TO/received".
  double figure(std::string_view path) const;
  /// The whole report, as `takt run --report` writes it.
  std::string report() const;

 private:
  const void* message(std::string_view port, size_t i, const MessageType& type) const;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt
