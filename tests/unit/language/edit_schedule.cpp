// SPDX-License-Identifier: Apache-2.0
#include "graph/language/edit_schedule.hpp"

#include <random>

#include "graph/language/quantity.hpp"
#include "tests/unit/language/fixture.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;

namespace {

MeasuredSpec example() {
  MeasuredSpec measured;
  measured.machine = {"A \"quoted\" \\ CPU", 2, "6.1 #1"};
  measured.at = "2026-11-21T23:00:00Z";
  measured.policy = "deadline";
  measured.quantile = 0.99;
  measured.margin = 1.2;
  measured.nodes["stereo"] = {12'512'345, 300};
  return measured;
}

std::string edited(const std::string& text, const std::map<std::string, int64_t>& budgets) {
  const auto result = with_budgets(text, "s.yaml", budgets, example());
  REQUIRE_MESSAGE(result.has_value(), (result ? "" : to_string(result.error())));
  return *result;
}

/// What stands before the block.
std::string head(const std::string& text) { return text.substr(0, text.find("measured:")); }

}  // namespace

TEST_CASE("budgets are rounded up to what a person would write") {
  for (const auto& one : {std::pair<int64_t, const char*>{1, "1us"},
                          {1'000, "1us"},
                          {1'001, "2us"},
                          {540'000, "540us"},
                          {999'000, "999us"},
                          {999'001, "1ms"},
                          {1'000'001, "1.01ms"},
                          {9'321'000, "9.33ms"},
                          {9'996'000, "10ms"},
                          {12'512'345, "12.6ms"},
                          {12'500'000, "12.5ms"},
                          {99'950'000, "100ms"},
                          {123'400'000, "124ms"},
                          {2'000'000'000, "2000ms"}}) {
    const int64_t ns = one.first;
    CAPTURE(ns);
    CHECK(budget_text(ns) == one.second);
  }
}

TEST_CASE("a rounded budget is never smaller, and at most 1 % and 1 us larger") {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20'000; ++i) {
    const int64_t ns = 1 + static_cast<int64_t>(random() % (uint64_t{1} << (1 + random() % 33)));
    const auto read = parse_duration_ns(budget_text(ns));
    REQUIRE(read);
    CAPTURE(ns);
    CHECK(*read >= ns);
    CHECK(*read <= ns + ns / 100 + 1'000);
  }
}

TEST_CASE("budgets are replaced where they stand; comments, order and blanks stay") {
  const std::string text =
      "# above\ntakt: 1\nname: a   # a name\nnodes:\n"
      "  # of stereo\n  stereo: {rate: 15,   budget: 12ms , deadline: 1/15 s}  # why\n"
      "  slow:\n    rate: 2\n    budget: 1/100 s  # long\n    deadline: 400ms\n"
      "  said: {rate: 1, budget: \"3 ms\"}\n# below\n";
  CHECK(head(edited(text, {{"stereo", 9'000'000}, {"slow", 5'500'000}, {"said", 1'000}})) ==
        "# above\ntakt: 1\nname: a   # a name\nnodes:\n"
        "  # of stereo\n  stereo: {rate: 15,   budget: 9ms , deadline: 1/15 s}  # why\n"
        "  slow:\n    rate: 2\n    budget: 5.5ms  # long\n    deadline: 400ms\n"
        "  said: {rate: 1, budget: 1us}\n# below\n");
}

TEST_CASE("a budget that is not there becomes the first word of its entry, a missing entry the first of nodes") {
  CHECK(head(edited("takt: 1\nname: a\nnodes:\n  flow: {rate: 1}\n  block:\n    rate: 2  # two\n  none: {}\n",
                    {{"flow", 1'000'000}, {"block", 2'000'000}, {"none", 3'000'000}, {"new", 4'000'000}})) ==
        "takt: 1\nname: a\nnodes:\n  new: {budget: 4ms}\n  flow: {budget: 1ms, rate: 1}\n  block:\n    budget: 2ms\n"
        "    rate: 2  # two\n  none: {budget: 3ms}\n");
  CHECK(head(edited("takt: 1\nname: a\nnodes: {flow: {rate: 1}}", {{"new", 4'000'000}})) ==
        "takt: 1\nname: a\nnodes: {new: {budget: 4ms}, flow: {rate: 1}}\n");
}

TEST_CASE("the block `measured` is added once and replaced afterwards, in either style") {
  const std::string text = "takt: 1\nname: a\nnodes:\n  stereo: {rate: 15}\n";
  const std::string once = edited(text, {{"stereo", 9'000'000}});
  CHECK(edited(once, {{"stereo", 9'000'000}}) == once);
  const std::string middle =
      "takt: 1\nmeasured:\n  # old\n  at: x\n\n# of the name\nname: a\nnodes:\n  stereo: {rate: 15}\n";
  const std::string replaced = edited(middle, {});
  CHECK(replaced.find("# old") == std::string::npos);
  CHECK(replaced.find("# of the name\nname: a\nnodes:\n  stereo: {rate: 15}\n") != std::string::npos);
  const std::string flow = edited("takt: 1\nmeasured: {at: x,\n  policy: y\n}\nname: a\nnodes: {}\n", {});
  CHECK(flow.find("policy: y") == std::string::npos);
  CHECK(flow.find("name: a\nnodes: {}\n") != std::string::npos);
}

TEST_CASE("what cannot be edited is refused with the place") {
  for (const auto& one :
       {std::pair{"{takt: 1, name: a, nodes: {}}\n", "in braces"}, std::pair{"takt: 1\nname: a\n", "no map `nodes`"},
        std::pair{"takt: 1\nnodes: [\n", "YAML"}, std::pair{"takt: 1\nnodes:\n  stereo: 5\n", "no map"},
        std::pair{"takt: 1\nnodes:\n  stereo: {budget: \"1\\x6ds\"}\n", "cannot be replaced"}}) {
    const std::string text = one.first, words = one.second;
    CAPTURE(text);
    const auto result = with_budgets(text, "s.yaml", {{"stereo", 1'000'000}}, example());
    REQUIRE(!result);
    CHECK(to_string(result.error()).find(words) != std::string::npos);
    CHECK(to_string(result.error()).rfind("s.yaml:", 0) == 0);
  }
}

TEST_CASE("what was written is read again") {
  const Files files(kGraph, edited(kSchedule, {{"stereo", 15'014'814}, {"planner", 1'000'000}}));
  const Loaded loaded = files.load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  const ScheduleSpec& schedule = loaded.graph->schedule;
  CHECK(schedule.entries.at("stereo").budget_ns == 15'100'000);
  CHECK(schedule.entries.at("planner").budget_ns == 1'000'000);
  REQUIRE(schedule.measured);
  const MeasuredSpec wanted = example();
  CHECK(schedule.measured->machine == wanted.machine);
  CHECK(schedule.measured->at == wanted.at);
  CHECK(schedule.measured->policy == wanted.policy);
  CHECK(schedule.measured->quantile == wanted.quantile);
  CHECK(schedule.measured->margin == wanted.margin);
  REQUIRE(schedule.measured->nodes.contains("stereo"));
  CHECK(schedule.measured->nodes.at("stereo").exec_ns == 12'512'000);
  CHECK(schedule.measured->nodes.at("stereo").samples == 300);
}

TEST_CASE("a wrong block `measured` is reported with its place") {
  const std::string block =
      "measured:\n  machine: {cpu: x, cores: 2, kernel: y}\n  at: \"z\"\n  policy: fixed\n  quantile: 0.99\n"
      "  margin: 1.2\n  nodes:\n    stereo: {exec: 5ms, samples: 3}\n";
  const Loaded good = Files(kGraph, kSchedule + block).load();
  INFO(all(good));
  CHECK(good.graph);
  const auto wrong = [&](const std::string& from, const std::string& to, const std::string& at,
                         const std::vector<std::string>& words) {
    const std::string text = kSchedule + with(block, from, to);
    expect_at(Files(kGraph, text).load(), "schedule.yaml", text, at, words, kSchedule.size());
  };
  wrong("stereo: {exec", "stere: {exec", "stere: {exec", {"stere", "did you mean `stereo`"});
  wrong("exec: 5ms", "exec: 5", "5, samples", {"exec", "stereo", "unit"});
  wrong("quantile: 0.99", "quantile: 99", "99", {"quantile", "from 0 to 1"});
  wrong("policy: fixed", "policy: fifo", "fifo", {"policy", "fixed"});
  wrong("  margin: 1.2\n", "", "measured", {"margin"});
}
