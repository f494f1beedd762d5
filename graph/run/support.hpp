// SPDX-License-Identifier: Apache-2.0
// What a run in one process and a run in several have in common.
#pragma once
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/attach/server.hpp"
#include "graph/check/check_machine.hpp"
#include "graph/check/proofs.hpp"
#include "graph/run/run.hpp"
#include "hal/settings/json.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/sched/stall_watch.hpp"

namespace takt::command {

/// While it lives SIGINT, SIGTERM and SIGHUP end the run cleanly; one that comes while the run is still being prepared
/// ends it as soon as there is something to end. Further signals change nothing, up to the exit of the process. An
/// ignored SIGHUP (nohup) stays ignored; SIGINT does not: shells ignore it for whatever a script starts in the
/// background. One at a time; throws std::bad_alloc.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;
  /// In this process, or in one that was forked from it since.
  static bool asked();
};

/// The run that a signal stops while this lives.
class Stoppable {
 public:
  explicit Stoppable(RunBoard& board);
  ~Stoppable();
  Stoppable(const Stoppable&) = delete;
  Stoppable& operator=(const Stoppable&) = delete;
};

/// A file that is written at the end stays where it was asked for, even if this process gets another /tmp meanwhile:
/// while this lives, `file` is named by the descriptor of its folder.
class KeptPlace {
 public:
  explicit KeptPlace(std::filesystem::path& file);
  ~KeptPlace();
  KeptPlace(const KeptPlace&) = delete;
  KeptPlace& operator=(const KeptPlace&) = delete;

 private:
  int folder_ = -1;
};

/// The cores of the schedule that this process may use; all it may use if the schedule names none, or none of those.
/// Says what it changed of cores that the schedule names.
void choose_cores(std::vector<int>& cores, std::vector<std::string>& adjusted);

/// This machine, with what `takt doctor --measure` left.
graph::CheckMachine this_machine();

/// Asks the check. What it proved (nothing, if it did not admit the plan): the run may go on; else what was refused
/// is on stderr and this is the exit code. --unchecked goes on in spite of everything but Invalid input. So does
/// `cooperative` in spite of an answer that is not proven, and says so in `adjusted`: it promises no deadline, and no
/// proof would hold among ordinary threads. The policy that was asked for is the one that is checked; what the kernel
/// refuses and replaces by `cooperative` later is not asked again.
tl::expected<graph::Proofs, Exit> admit(const RunOptions& options, const graph::GraphSpec& graph, const Plan& plan,
                                        const graph::CheckMachine& machine, std::vector<std::string>& adjusted);

/// Looks for stalls of the machine where something was proven and real time passes; else null. Everything given
/// outlives it.
std::unique_ptr<StallWatch> watch_stalls(const graph::Proofs& proofs, const Plan& plan, const Clock& clock,
                                         const RunBoard& board);

/// Memory locked, OpenCV's thread pool off; what was refused.
std::vector<std::string> prepare_process(const Registry& registry);

/// Says why nobody can attach, or which folder was passed over.
void tell_attach(const attach::Server& server, std::vector<std::string>& adjusted);

/// Prints the summary, writes the files that were asked for; the exit code of the run, if all could be written.
int tell(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph,
         const nlohmann::ordered_json& report);

/// The same of a run in which nodes may have done what they must not. A job that hung under `cooperative` is a failure
/// of the run, exit 3.
int tell_faults(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph,
                const RunBoard& board, Policy granted, nlohmann::ordered_json& report);

/// The exit code of such a run if everything can be written; corrects "ok" in the report.
int run_exit(const RunBoard& board, Policy granted, nlohmann::ordered_json& report);

/// True if that task has a job that never returned.
bool is_stuck(const RunResult& result, size_t task);

/// Ends this process at once, without taking down what a stuck job still uses.
[[noreturn]] void end_process(int code, const std::string& transport);

}  // namespace takt::command
