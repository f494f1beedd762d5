// SPDX-License-Identifier: Apache-2.0
#include "graph/run/support.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <new>

#include "graph/check/check.hpp"
#include "graph/check/figures_file.hpp"
#include "graph/cli/boundary.hpp"
#include "graph/run/junit.hpp"
#include "graph/run/machine.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/report.hpp"
#include "graph/view/html_report.hpp"
#include "rt/machine/facts.hpp"
#include "rt/shm/iceoryx_preflight.hpp"

namespace takt::command {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
std::array<struct sigaction, kSignals.size()> g_old{};
std::atomic<RunBoard*> g_running{nullptr};
// Shared with the processes forked later: one signal to any of those that listen ends all of them.
std::atomic<bool>* g_stop_asked = nullptr;

void share_stop_asked() {
  if (g_stop_asked != nullptr) return;
  void* memory = mmap(nullptr, sizeof(std::atomic<bool>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  g_stop_asked = ::new (memory) std::atomic<bool>(false);
}

void stop_now(RunBoard& board) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  board.stop().raise(now.tv_sec * 1'000'000'000 + now.tv_nsec);
}

extern "C" void stop_running(int) {
  g_stop_asked->store(true);
  if (RunBoard* board = g_running.load()) stop_now(*board);
}

}  // namespace

StopOnSignal::StopOnSignal() {
  share_stop_asked();
  g_stop_asked->store(false);
  struct sigaction action {};
  action.sa_handler = stop_running;
  action.sa_flags = SA_RESTART;  // the summary goes through a pipe that may be full: stdio drops what is interrupted
  for (size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &g_old[i]);
    if (kSignals[i] != SIGHUP || g_old[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
  }
}

StopOnSignal::~StopOnSignal() {
  if (asked()) return;  // a second signal must not change how this process ends
  for (size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &g_old[i], nullptr);
}

bool StopOnSignal::asked() { return g_stop_asked != nullptr && g_stop_asked->load(); }

Stoppable::Stoppable(RunBoard& board) {
  g_running.store(&board);
  if (StopOnSignal::asked()) stop_now(board);
}

Stoppable::~Stoppable() { g_running.store(nullptr); }

KeptPlace::KeptPlace(std::filesystem::path& file) {
  if (file.empty()) return;
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  folder_ = open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  if (folder_ >= 0) file = fmt::format("/proc/self/fd/{}/{}", folder_, file.filename().string());
}

KeptPlace::~KeptPlace() {
  if (folder_ >= 0) close(folder_);
}

void choose_cores(std::vector<int>& cores, std::vector<std::string>& adjusted) {
  const std::vector<int> allowed = machine::SystemFacts().allowed_cpus();
  if (allowed.empty()) return;  // not known
  std::vector<int> usable;
  for (const int core : cores)
    if (std::find(allowed.begin(), allowed.end(), core) != allowed.end()) usable.push_back(core);
  const bool named = !cores.empty();
  if (named && usable.size() == cores.size()) return;
  if (usable.empty()) usable = allowed;
  if (named)
    adjusted.push_back(fmt::format("cores [{}] -> [{}]: this process may use no others", fmt::join(cores, ", "),
                                   fmt::join(usable, ", ")));
  cores = usable;
}

graph::CheckMachine this_machine() { return graph::check_machine(machine::SystemFacts(), graph::figures_file()); }

tl::expected<graph::Proofs, Exit> admit(const RunOptions& options, const graph::GraphSpec& graph, const Plan& plan,
                                        const graph::CheckMachine& machine, std::vector<std::string>& adjusted) {
  graph::CheckOptions how;
  how.machine = machine;
  how.real_time = options.clock != "virtual";
  const graph::CheckResult check = graph::check(graph, plan, how);
  const auto refused = [&](const std::string& text, Exit code) {
    refuse(text, code);
    return tl::make_unexpected(code);
  };
  if (check.verdict == graph::Verdict::invalid) return refused(check.text, kBadInput);
  graph::Proofs proofs = graph::proofs_of(plan, check, machine);
  if (check.admitted || options.unchecked) return proofs;
  if (plan.policy != Policy::cooperative || check.answer != graph::Answer::not_proven)
    return refused(check.text + "(--unchecked runs it all the same)", kNotOk);
  adjusted.push_back(
      "admission -> none: under the policy cooperative the deadlines are not proven (takt check says why)");
  return proofs;
}

std::unique_ptr<StallWatch> watch_stalls(const graph::Proofs& proofs, const Plan& plan, const Clock& clock,
                                         const RunBoard& board) {
  if (clock.is_virtual() || plan.policy == Policy::cooperative || proofs.modes.empty()) return nullptr;
  return std::make_unique<StallWatch>(plan, board, stolen_ns);
}

std::vector<std::string> prepare_process(const Registry& registry) {
  for (const auto prepare : registry.before_jobs) prepare();
  return prepare_process_memory().lacks;
}

void tell_attach(const attach::Server& server, std::vector<std::string>& adjusted) {
  const std::string text = server.lacks().empty() ? server.note() : "nobody can attach: " + server.lacks();
  if (text.empty()) return;
  adjusted.push_back(text);
  std::fprintf(stderr, "takt: adjusted: %s\n", text.c_str());
}

int tell(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph,
         const nlohmann::ordered_json& report) {
  if (options.witness == nullptr) std::fputs(summary_text(report).c_str(), stdout);
  RunOutputs& outputs = *options.outputs;
  outputs.write(outputs.report, report.dump(2) + "\n", "--report");
  if (outputs.html) outputs.write(outputs.html, view::html_report(registry, report, graph, options.output), "--html");
  if (outputs.junit) outputs.write(outputs.junit, junit_text(report), "--junit");
  return report["ok"].get<bool>() ? kOk : kNotOk;
}

int tell_faults(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph,
                const RunBoard& board, Policy granted, nlohmann::ordered_json& report) {
  const bool failed = run_exit(board, granted, report) == kDeviceOrSystem;
  const int told = tell(registry, options, graph, report);
  return failed ? static_cast<int>(kDeviceOrSystem) : told;
}

int run_exit(const RunBoard& board, Policy granted, nlohmann::ordered_json& report) {
  const bool failed = granted == Policy::cooperative && hung(board);
  if (failed) report["ok"] = false;
  return failed ? kDeviceOrSystem : report["ok"].get<bool>() ? kOk : kNotOk;
}

bool is_stuck(const RunResult& result, size_t task) {
  return std::find(result.stuck.begin(), result.stuck.end(), task) != result.stuck.end();
}

void end_process(int code, const std::string& transport) {
  code = with_output(code);
  std::fflush(nullptr);
  if (transport == "iceoryx") remove_iceoryx_leftovers(IceoryxPlaces::of_this_machine(), getpid());
  std::_Exit(code);
}

}  // namespace takt::command
