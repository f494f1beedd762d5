// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/watched.hpp"

#include <doctest/doctest.h>

using namespace takt::top;

namespace {

Json description() {
  return Json::parse(R"({"name": "ace", "profile": "sim", "policy": "deadline", "pid": 77,
    "nodes": [{"name": "stereo", "device": false, "process": "depth", "rate_hz": 15.0, "deadline_ms": 66.7,
               "budget_ms": 25.0, "criticality": "low", "proven_ms": null, "levels": 3}],
    "chains": [{"name": "stop", "from": "a.b", "to": "c.d", "bound_ms": 150.0, "proven_ms": 120.5}]})");
}

Json state(double running_s) {
  return {{"running_s", running_s},
          {"mode", "full"},
          {"nodes", Json::parse(R"([{"completed": 187, "deadline_misses": 2, "skipped": 3, "paused": 4, "overruns": 5,
                                     "level": 1, "exec_ms": 21.0, "response_ms": 25.2, "response_max_ms": 31.0}])")},
          {"devices", Json::parse(R"([{"name": "laser", "state": "ok", "losses": 1, "received": 812, "damaged": 2,
                                       "resyncs": 3, "missing": 4, "unsent": 5, "trouble": "x"}])")},
          {"chains", Json::parse(R"([{"age_ms": 61.2, "age_max_ms": null}])")},
          {"processes", Json::parse(R"([{"name": "depth", "pid": 4713, "state": "running", "restarts": 1}])")},
          {"parameters", Json::array()},
          {"frozen", Json::array()}};
}

Json line(double running_s, size_t jobs = 0, size_t events = 0) {
  Json all{{"state", state(running_s)}, {"epoch_ns", 1}, {"jobs", Json::array()}, {"events", Json::array()}};
  for (size_t j = 0; j < jobs; ++j) all["jobs"].push_back({0, running_s - 0.1, running_s - 0.1, running_s, 1});
  for (size_t e = 0; e < events; ++e)
    all["events"].push_back({{"at_s", running_s}, {"kind", "mark"}, {"node", ""}, {"text", std::to_string(e)}});
  return all;
}

}  // namespace

TEST_CASE("what a run says of itself is all taken over; null is nothing") {
  Watched run = watched(description());
  CHECK(run.pid == 77);
  CHECK(!run.heard);
  CHECK(run.nodes[0].budget_ms == 25.0);
  CHECK(!run.nodes[0].proven_ms);
  take(line(12.5), run);
  CHECK(run.heard);
  CHECK(run.mode == "full");
  CHECK(run.nodes[0].deadline_misses == 2);
  CHECK(run.nodes[0].overruns == 5);
  CHECK(run.chains[0].age_ms == 61.2);
  CHECK(!run.chains[0].age_max_ms);
  CHECK(run.devices[0].missing == 4);
  CHECK(run.devices[0].unsent == 5);
  CHECK(run.processes[0].restarts == 1);
  take_use({0.5, 10, 0, {{0.25, 3}}}, run);
  CHECK(run.processes[0].cpu == 0.25);
  take({{"error", "something"}}, run);  // no state: nothing changes
  CHECK(run.running_s == 12.5);
}

TEST_CASE("jobs are kept as long as the timeline shows them, events up to a number; what is left out is counted") {
  Watched run = watched(description());
  take(line(1, 3), run);
  take(line(9, 2), run);
  CHECK(run.nodes[0].jobs.size() == 5);
  CHECK(!run.nodes[0].jobs_unseen);
  take(line(11.5, 63), run);
  CHECK(run.nodes[0].jobs.size() == 65);
  CHECK(run.nodes[0].jobs_unseen);
  take(line(12, 0, kMostEvents), run);
  CHECK(run.events_left_out == 0);
  take(line(13, 0, 2), run);
  CHECK(run.events.size() == kMostEvents);
  CHECK(run.events_left_out == 2);
  CHECK(run.events.back().text == "1");
}

TEST_CASE("an answer of another kind throws what the command reports") {
  CHECK_THROWS_AS(watched(Json{{"ok", true}}), Json::exception);
  Watched run = watched(description());
  Json wrong = line(1);
  wrong["state"]["nodes"] = Json::array();
  CHECK_THROWS_AS(take(wrong, run), Json::exception);
}
