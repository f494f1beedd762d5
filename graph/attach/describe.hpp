// SPDX-License-Identifier: Apache-2.0
// A run in words for programs that show it (graph/web): what it is, how it stands, what has happened since.
//
//   show(describe_json(subject));
//   JobsSince jobs(subject);
//   EventsSince events(subject);
//   while (looking) show(state_json(subject)), show(jobs.take()), show(events.take());
//
// Times are seconds of the run. Any thread, one at a time for each object; reads the board alone.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "graph/attach/subject.hpp"
#include "hal/settings/json.hpp"

namespace takt::attach {

/// The type of a node, the kind of a device; empty: there is none of that name.
std::string type_of(const Subject& subject, const std::string& id);

/// What stays as it is while the run goes on: nodes with their times and what was proven of them, ports with the layout
/// of their messages, chains, modes, processes, parameters. See graph/web/README.md, `graph`.
nlohmann::ordered_json describe_json(const Subject& subject);

/// How it stands now. See graph/web/README.md, `state`; what a process takes of the machine is not in it.
nlohmann::ordered_json state_json(const Subject& subject);

/// Jobs that were finished since the last look: [[node, release_s, start_s, finish_s, CPU], ...]. The board has the
/// last 64 of each node: who looks too seldom misses some.
class JobsSince {
 public:
  explicit JobsSince(const Subject& subject);
  nlohmann::ordered_json take();

 private:
  const Subject& subject_;
  std::vector<uint64_t> taken_;  ///< by task
};

/// Faults, changes of mode, marks, outages, parameters that were set, files that were frozen and what nodes said since
/// the last look: [{"at_s": 3.2, "kind": "fault", "node": "stereo", "text": "..."}, ...], in the order of their
/// instants; what a node said has the kind `log` and a `level`, as LogLevel names it.
class EventsSince {
 public:
  explicit EventsSince(const Subject& subject);
  nlohmann::ordered_json take();

 private:
  struct Event;
  void take_faults(std::vector<Event>& all);
  void take_modes(std::vector<Event>& all);
  void take_marks(std::vector<Event>& all);
  void take_outages(std::vector<Event>& all);
  void take_parameters(std::vector<Event>& all);
  void take_frozen(std::vector<Event>& all);
  void take_logs(std::vector<Event>& all);

  const Subject& subject_;
  size_t faults_ = 0, modes_ = 0, marks_ = 0;
  int64_t outage_ns_ = 0;                    ///< the newest instant of an outage that was told
  std::vector<std::vector<uint32_t>> sets_;  ///< by task and parameter: values accepted so far
  std::vector<std::string> frozen_;
  std::vector<LogReader> logs_;  ///< by task
};

}  // namespace takt::attach
