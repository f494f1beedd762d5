// SPDX-License-Identifier: Apache-2.0
// A trace as a file, and back.
#include "graph/explain/trace_file.hpp"

#include <doctest/doctest.h>

#include <map>
#include <random>
#include <sstream>

#include "graph/explain/file_format.hpp"
#include "graph/explain/miss_svg.hpp"
#include "graph/explain/sentence.hpp"
#include "tests/unit/rt/trace_fixture.hpp"

namespace {

using namespace takt;
using namespace takt::trace::by_hand;
using explain::Json;
using trace::Slice;

/// The trace of the house plan's sentence, with everything that a trace can hold.
trace::Trace sample(trace::Source source = trace::Source::tracefs) {
  trace::Trace trace = two_lanes(source);
  trace.policy = "fixed";
  trace.source_note = "a \"quoted\" note";
  trace.epoch_ns = 123'456'789'012'345;
  trace.end_ns = trace.epoch_ns + 20'000 * kUs;
  trace.first_ns = -1'000 * kUs;
  trace.losses = {1, 2, 3, 4};
  trace.jobs = {job(1, 80, -1'000, -900, -500, 300), job(2, 81, 0, 300, 19'200, 9'800),
                job(0, 7, 4'000, 4'000, 13'100, 9'100)};
  trace.jobs[0].published = {{0, 5, -1'000 * kUs}};
  trace.jobs[1].latched = {{0, 5, -1'000 * kUs}};
  trace.jobs[1].level = 1;
  trace.slices = {slice(12, 1, 300, 4'000, Slice::End::preempted, 290), slice(11, 1, 4'000, 13'100, Slice::End::asleep),
                  slice(12, 1, 13'100, 19'200, Slice::End::open)};
  trace.slices[0].from_ns += 1;  // nothing is rounded to microseconds
  trace.marks = {{trace::Kind::skip, 5, 0, 0, 82, 2},
                 {trace::Kind::overrun, 6, 9'800, 5'000, 81, 2},
                 {trace::Kind::level, 7, 1, 0, 81, 2},
                 {trace::Kind::mode, 8, 2, 0, 0, trace::kNoTask}};
  trace.steals = {{0, 100, 10, 0}};
  return trace;
}

Json written(const trace::Trace& trace) {
  std::ostringstream out;
  explain::write_trace(out, {{"graph", "g"}, {"schedule", "s"}}, trace);
  return Json::parse(out.str());
}

}  // namespace

TEST_CASE("what is written is read back, to the nanosecond") {
  const trace::Trace before = sample();
  const Json file = written(before);
  const auto read = explain::read_trace(file);
  REQUIRE_MESSAGE(read.has_value(), (read ? "" : read.error()));
  CHECK(read->head["graph"] == "g");
  CHECK(written(read->trace)["traceEvents"] == file["traceEvents"]);
  const trace::Trace& after = read->trace;
  CHECK(after.slices[0].from_ns == before.slices[0].from_ns);
  CHECK(after.slices[0].woken_ns == before.slices[0].woken_ns);
  CHECK(after.jobs[1].published_ns == before.jobs[1].published_ns);
  CHECK(after.losses.forgotten == 3);
  CHECK(after.first_ns == before.first_ns);
  const trace::Evidence one(before), other(after);
  const auto a = trace::blame(one, before.jobs[1]), b = trace::blame(other, after.jobs[1]);
  REQUIRE(a.parts.size() == b.parts.size());
  for (size_t i = 0; i < a.parts.size(); ++i) {
    CHECK(a.parts[i].ns == b.parts[i].ns);
    CHECK(a.parts[i].who == b.parts[i].who);
  }
}

TEST_CASE("the format that perfetto loads: phases, named tracks, arrows with two ends in slices") {
  const Json file = written(sample());
  std::map<std::string, size_t> phases;
  std::map<uint64_t, std::string> arrows;
  for (const Json& event : file["traceEvents"]) {
    const std::string phase = event["ph"];
    ++phases[phase];
    CHECK(event.contains("pid"));
    CHECK(event.contains("tid"));
    CHECK((phase == "M" || event["ts"].is_number()));
    if (phase == "X") CHECK(event["dur"].get<double>() >= 0);
    if (phase == "s" || phase == "f") arrows[event["id"]] += phase;
  }
  CHECK(phases["X"] == 6);
  CHECK(phases["i"] == 5);  // four marks and a miss
  REQUIRE(arrows.size() == 1);
  CHECK(arrows[1] == "sf");
  CHECK(file["otherData"]["source_of_preemption"] == "tracefs");
  CHECK(file["otherData"]["lost"]["switches"] == 2);
}

TEST_CASE("the sentence names causes and the source, and its figures add up") {
  trace::Trace trace = sample();
  const auto said = [&] {
    const trace::Evidence evidence(trace);
    return explain::sentence(trace, trace.jobs[1], trace::blame(evidence, trace.jobs[1]));
  };
  CHECK(said() ==
        "ground_map missed job 81 by 9.20 ms: released late 0.30, preempted 9.10 by stereo on cpu 1, 4.80 over its own "
        "budget, less 5.00 of slack (switches from tracefs); 1 release was skipped after it");
  trace.source = trace::Source::perf;
  CHECK(said().find("preempted 9.10 by stereo on cpu 1") != std::string::npos);
  CHECK(said().find("(switches from perf, which sees our own threads only)") != std::string::npos);
  std::erase_if(trace.slices, [&](const trace::Slice& slice) { return slice.thread != trace.jobs[1].thread; });
  CHECK(said().find("preempted 9.10 by unnamed others") != std::string::npos);
  trace.source = trace::Source::none;
  CHECK(said().find("9.10 unattributed") != std::string::npos);
  CHECK(said().find("no source") != std::string::npos);
}

TEST_CASE("a budget above the deadline adds to the miss, it leaves no slack") {
  trace::Trace trace = sample();
  trace.jobs[1].deadline_ns = trace.jobs[1].release_ns + 9'500'000;
  trace.tasks[trace.jobs[1].task].budget_ns = 10'000'000;
  const trace::Evidence evidence(trace);
  const trace::Blame blame = trace::blame(evidence, trace.jobs[1]);
  REQUIRE(blame.parts.back().cause == trace::Cause::slack);
  CHECK(blame.parts.back().ns == 299'999);  // ran 9.8 ms, less the 1 ns that its slice begins late
  const std::string text = explain::sentence(trace, trace.jobs[1], blame);
  INFO(text);
  CHECK(text.find("0.30 of its budget beyond its deadline") != std::string::npos);
  CHECK(text.find("less") == std::string::npos);
}

TEST_CASE("rounded figures add up, whatever the parts") {
  std::mt19937 random(11);
  trace::Trace trace = sample();
  trace.marks.clear();
  for (int round = 0; round < 500; ++round) {
    trace::Blame blame;
    for (int i = 0; i < 7; ++i) {
      const auto cause = i == 6 ? trace::Cause::slack : i > 2 ? trace::Cause::preempted : trace::Cause::budget;
      const int64_t ns = static_cast<int64_t>(random() % 9'000'000);
      blame.parts.push_back({cause, i == 6 ? -ns / 4 : ns, "n" + std::to_string(i), i});
      blame.miss_ns += blame.parts.back().ns;
    }
    const std::string text = explain::sentence(trace, trace.jobs[1], blame);
    INFO(text);
    // Every number with a decimal point: the first is the miss, the last the slack.
    std::vector<double> figures;
    for (size_t at = 0; (at = text.find('.', at)) != std::string::npos; ++at) {
      const size_t from = text.find_last_not_of("0123456789", at - 1) + 1;
      figures.push_back(std::stod(text.substr(from)));
    }
    REQUIRE(figures.size() >= 2);
    double sum = 0;
    for (size_t i = 1; i < figures.size(); ++i) sum += figures[i];
    if (text.find("less") != std::string::npos) sum -= 2 * figures.back();
    CHECK(sum == doctest::Approx(figures[0]).epsilon(1e-9));
  }
}

TEST_CASE("parts that do not make up the miss are not made to") {
  const trace::Trace trace = sample();
  trace::Blame blame;
  blame.parts = {{trace::Cause::preempted, 9'104'000, "a", 1}, {trace::Cause::budget, 1'002'000}};
  blame.miss_ns = 10'106'000;
  CHECK(explain::sentence(trace, trace.jobs[1], blame).find("by 10.1 ms: preempted 9.1 by a on cpu 1, 1.0 over") !=
        std::string::npos);
  blame.miss_ns = 10'352'000;  // 10.4, of which 0.3 are nobody's
  CHECK(explain::sentence(trace, trace.jobs[1], blame).find("by 10.4 ms: preempted 9.1 by a on cpu 1, 1.0 over") !=
        std::string::npos);
}

TEST_CASE("files that are no traces are refused with words, never with a crash") {
  CHECK(explain::read_trace(Json::parse("[]")).error() == "is no trace of a run");
  CHECK(explain::read_trace(Json()).error() == "is no trace of a run");
  const Json file = written(sample());
  // Every value once taken away, once replaced by something else.
  std::mt19937 random(5);
  const Json flat = file.flatten();
  std::vector<std::string> places;
  for (const auto& [place, value] : flat.items()) places.push_back(place);
  for (const std::string& place : places) {
    for (const Json& other : {Json(nullptr), Json("words"), Json(-1), Json(1e300), Json(99999), Json::array(),
                              Json(INT64_MIN), Json(INT64_MAX), Json(UINT64_MAX), Json(INT32_MIN)}) {
      Json damaged = file;
      damaged[Json::json_pointer(place)] = other;
      if (const auto read = explain::read_trace(damaged)) {
        const trace::Evidence evidence(read->trace);
        for (const trace::JobSpan& job : read->trace.jobs) {
          const trace::Blame blame = trace::blame(evidence, job);
          CHECK_FALSE(explain::sentence(read->trace, job, blame).empty());
        }
      }
    }
  }
}

TEST_CASE("the picture holds the node, the CPU, the deadline and every cause, as well-formed XML") {
  trace::Trace trace = sample();
  trace.tasks[2].name = "a<b";
  const trace::Evidence evidence(trace);
  const std::string svg = explain::miss_svg(evidence, trace.jobs[1]);
  for (const char* words :
       {"<svg xmlns", "a&lt;b job 81", "CPU 1", "deadline", "preempted by stereo on cpu 1", "</svg>"})
    CHECK_MESSAGE(svg.find(words) != std::string::npos, words);
  CHECK(svg.find("a<b") == std::string::npos);
}

TEST_CASE("a report says how often and how long, and that it cannot say why") {
  const Json node = Json::parse(R"({"name":"n","deadline_misses":2,"released":10,"budget_overruns":1,
    "lateness_us":{"max":1500.0},"exec_ms":{"max":3.0},"response_ms":{"max":null},"preempted_ms":4.0})");
  const std::string text = explain::report_sentence(node);
  CHECK(text.find("n missed 2 of 10 jobs") == 0);
  CHECK(text.find("no cause is attributed") != std::string::npos);
  CHECK(text.find("longest start after release 1.5 ms") != std::string::npos);
  CHECK(text.find("longest response not known") != std::string::npos);
  CHECK(explain::report_sentence(Json::parse(R"({"name":"n","deadline_misses":0})")).empty());
  CHECK(explain::report_sentence(Json::parse(R"({"name":3,"deadline_misses":"x"})")).empty());
}

TEST_CASE("a trace says its format; a later one is refused with the Takt that it needs, one without is the first") {
  const Json head = written(sample())["otherData"];
  CHECK(head["format"] == explain::kTraceFormat);
  CHECK_FALSE(explain::later_format(head, explain::kTraceFormat));
  CHECK_FALSE(explain::later_format(Json::parse(R"({"graph":"g"})"), 1));
  const auto later = explain::later_format(Json::parse(R"({"format":3,"commit":"abc"})"), 2);
  REQUIRE(later);
  CHECK(later->find("is of format 3") == 0);
  CHECK(later->find("reads format 2; use a later Takt (commit abc wrote the file)") != std::string::npos);
}
