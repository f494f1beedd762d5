// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "graph/cli/outcome.hpp"
#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt {
struct Plan;
class Transport;
}  // namespace takt

namespace takt::command {

/// A program that looks on while a run goes in virtual time, called on the thread of the run. The run then prints
/// nothing but errors.
class RunWitness {
 public:
  virtual ~RunWitness() = default;
  /// The pools are there, no job has run. Plan and transport live until end().
  virtual void begin(const Plan& plan, Transport& transport) = 0;
  /// After every half of a job.
  virtual void look() = 0;
  /// The run is over and judged.
  virtual void end(const nlohmann::ordered_json& report) = 0;
};

struct RunOutputs;  // graph/run/outputs.hpp
class WebBeside;    // graph/run/web_beside.hpp

struct RunOptions {
  std::filesystem::path graph;  ///< empty: graph/ace.yaml of the project
  graph::LoadOptions load;
  double duration_s = 20;       ///< 0: until stopped
  bool duration_asked = false;  ///< else a graph that expects something says how long
  bool unchecked = false, require_rt = false;
  std::string clock = "real", isolate;
  std::string durations = "budgets";  ///< of jobs in virtual time, see job_durations()
  std::string transport = "local";    ///< local | iceoryx
  std::filesystem::path report, html, junit, trace, record, output = "out";
  std::filesystem::path keys;             ///< of this machine, see graph/keys; empty: it has none
  std::filesystem::path faults;           ///< scenario of faults that the run is given; empty: none
  std::vector<std::string> record_ports;  ///< NODE.PORT: with all fields, beside devices and small ones; "all"
  std::string trace_source = "auto";      ///< of preemption: auto (the best there is), tracefs, perf, none
  std::string ring = "auto";              ///< auto (on in real time, unless the graph says no), on, off
  bool web = false;                       ///< `takt web` beside it, as the graph's `web` has it
  std::shared_ptr<WebBeside> shown;       ///< that; by run_graph(), begun once the run is admitted
  bool keep_ring = false;                 ///< what that comes to; by run_graph()
  uint64_t seed = 1;
  std::filesystem::path watchdog;  ///< device that resets the machine unless the run is well; empty: none
  int watchdog_timeout_s = 10;     ///< asked of it
  RunWitness* witness = nullptr;   ///< asks for `clock` virtual
  bool brought_up = false;         ///< drives only what somebody tried, see graph/bringup; by who calls run_graph()
  std::function<void(graph::GraphSpec&)> alter = {};  ///< of the graph that is loaded, before it is composed
  std::shared_ptr<RunOutputs> outputs;  ///< the files above, as long as the run has them; made by run_graph()
  /// A policy named on the command line, or --require-rt: refused means exit 3, not another policy.
  bool policy_required() const { return require_rt || !load.policy.empty(); }
};

/// `takt run`: loads, checks, composes, runs, reports. Returns the exit code.
int run_graph(const Registry& registry, const RunOptions& options);

}  // namespace takt::command
