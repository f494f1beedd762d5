// SPDX-License-Identifier: Apache-2.0
#include "graph/testing.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <string>

#include "graph/ace/ace_registry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/text_status.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;

namespace {

/// A node that counts, and one that follows it with half its rate.
struct CountingGraph {
  test::TemporaryFolder folder;
  std::filesystem::path graph = folder.path / "counting.yaml";

  CountingGraph() {
    std::ofstream(graph) << R"(takt: 1
name: counting
schedule: schedule.yaml
subsystems:
  all:
    first: {type: load, params: {work: 1ms}}
    second: {type: load, in: {input: first.output}, params: {work: 1ms}}
)";
    std::ofstream(folder.path / "schedule.yaml") << R"(takt: 1
name: counting
policy: cooperative
cores: [0]
nodes:
  first: {rate: 10, budget: 5ms, criticality: high}
  second: {rate: 5, budget: 5ms, offset: 50ms}
)";
  }
};

const Registry& known() {
  static const Registry registry = ace_registry();
  return registry;
}

template <class Call>
std::string error_of(Call call) {
  try {
    call();
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return "no error";
}

std::string text_of(const GraphTest& test, std::string_view port, size_t i) {
  const auto& message = test.message<TextStatus>(port, i);
  return {message.text.data(), message.text.size};
}

}  // namespace

TEST_CASE("GraphTest: every message of a port and the figures of the report, the same in each run") {
  const CountingGraph counting;
  GraphTest test(counting.graph, known());
  test.watch("first.output");
  test.watch("second.output");
  for (int repeat = 0; repeat < 2; ++repeat) {
    REQUIRE(test.run_for(2.0) == 0);
    REQUIRE(test.count("first.output") == 20);
    REQUIRE(test.count("second.output") == 10);
    for (size_t i = 0; i < 20; ++i) CHECK(text_of(test, "first.output", i) == std::to_string(i));
    for (size_t i = 0; i < 10; ++i)
      CHECK(test.stamp_ns("second.output", i) == test.stamp_ns("first.output", 2 * i));  // it latches the newest
    CHECK(test.figure("duration_s") == 2.0);
    CHECK(test.figure("ok") == 1);
    CHECK(test.figure("nodes/first/completed") == 20);
    CHECK(test.figure("nodes/second/deadline_misses") == 0);
    CHECK(test.figure("edges/first.output -> second.input/sent") == 20);
    CHECK(test::has(test.report(), "\"graph\": "));
  }
}

TEST_CASE("GraphTest: parameters, and what a job needs in virtual time") {
  const CountingGraph counting;
  GraphTest test(counting.graph, known());
  test.watch("first.output");
  test.set("first.message_size=20");
  test.set("first.flood=true");
  test.run_for(0.5);
  REQUIRE(test.count("first.output") == 5);
  CHECK(text_of(test, "first.output", 4) == "4" + std::string(19, '.'));
}

TEST_CASE("GraphTest: a graph that cannot run gives the exit code of takt run") {
  const CountingGraph counting;
  GraphTest test(counting.graph, known());
  test.set("third.work=1ms");
  CHECK(test.run_for(1) == 2);
  CHECK(test::has(error_of([&] { test.figure("ok"); }), "no run has come to its end"));
  GraphTest missing(counting.folder.path / "none.yaml", known());
  CHECK(missing.run_for(1) == 2);
}

TEST_CASE("GraphTest: a wrong use is answered with the valid choices") {
  const CountingGraph counting;
  GraphTest test(counting.graph, known());
  test.watch("first.output");
  REQUIRE(test.run_for(0.3) == 0);
  CHECK(test::has(error_of([&] { test.figure("nodes/third/completed"); }), "no third among first, second"));
  CHECK(test::has(error_of([&] { test.figure("nodes/first"); }), "no number at nodes/first"));
  CHECK(test::has(error_of([&] { test.count("second.output"); }), "watch(\"second.output\") before the run"));
  CHECK(test::has(error_of([&] { test.stamp_ns("first.output", 3); }), "sent 3 messages; there is no message 3"));
  CHECK(test::has(error_of([&] { test.message<Pose>("first.output", 0); }), "carries text_status, not pose"));
  GraphTest other(counting.graph, known());
  other.watch("first.out");
  CHECK(test::has(error_of([&] { other.run_for(0.3); }), "no output first.out; it has first.output, second.output"));
}
