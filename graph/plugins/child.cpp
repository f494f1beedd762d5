// SPDX-License-Identifier: Apache-2.0
#include "graph/plugins/child.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <new>

#include "graph/cli/boundary.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/outcome.hpp"
#include "rt/machine/limits.hpp"
#include "rt/sched/append_log.hpp"

namespace takt::plugin {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr int64_t kSetupPatience_ns = 30 * kSecond;  ///< for one node; large files are read there
constexpr int64_t kEndPatience_ns = 10 * kSecond;    ///< after a signal
constexpr std::array kPassedOn{SIGINT, SIGTERM, SIGHUP, SIGQUIT};

int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

/// What the child says of itself, in memory that both have.
struct Progress {
  std::atomic<bool> ended{false};
  std::atomic<int64_t> setup_since_ns{0};  ///< 0: no node is being set up
  BoundedText<8192> node;                  ///< whose setup it is: "FILE:LINE:COLUMN: error: NODE"
};

Progress* g_progress = nullptr;  // the child finds it here

Progress& share_progress() {
  void* memory = mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  return *(g_progress = ::new (memory) Progress);
}

[[noreturn]] void be_the_child(pid_t parent, Registry& registry, const std::function<int()>& command) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  registry.setting_up = [](std::string_view node) {
    g_progress->setup_since_ns.store(0);
    if (node.empty()) return;
    g_progress->node = BoundedText<8192>(node);
    g_progress->setup_since_ns.store(now_ns());
  };
  command::at_end([] { g_progress->ended.store(true); });
  int code = command::kDeviceOrSystem;
  try {
    code = command();
  } catch (const std::exception& problem) {
    command::refuse(machine::explain(problem), command::kDeviceOrSystem);
  }
  std::exit(command::with_output(code));
}

/// How the child ended, or was made to end.
struct Ending {
  int status = 0;
  bool hung = false;  ///< in the setup of a node
  int passed_on = 0;  ///< the last signal that was; 0: none
  bool late = false;  ///< it did not end after that
};

class Watch {
 public:
  explicit Watch(const Progress& progress) : progress_(progress) {
    sigemptyset(&signals_);
    for (const int signal : kPassedOn) sigaddset(&signals_, signal);
    sigaddset(&signals_, SIGCHLD);
    sigprocmask(SIG_BLOCK, &signals_, &before_);
    signal(SIGCHLD, SIG_DFL);  // ignored, it would take the status of the child away
  }
  ~Watch() { restore(); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  void restore() const { sigprocmask(SIG_SETMASK, &before_, nullptr); }

  Ending until_end_of(pid_t child) {
    Ending ending;
    while (waitpid(child, &ending.status, WNOHANG) == 0) {
      const timespec step{0, 100'000'000};
      siginfo_t info{};
      const int signal = sigtimedwait(&signals_, &info, &step);
      if (signal > 0 && signal != SIGCHLD) pass_on(signal, info, child, ending);
      if (is_over(ending)) kill(child, SIGKILL);
    }
    return ending;
  }

 private:
  void pass_on(int signal, const siginfo_t& info, pid_t child, Ending& ending) {
    if (info.si_code != SI_KERNEL) kill(child, signal);  // a terminal sends it to the child as well
    ending.passed_on = signal;
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_IGN && give_up_ns_ == INT64_MAX) give_up_ns_ = now_ns() + kEndPatience_ns;
  }

  bool is_over(Ending& ending) const {
    const int64_t since_ns = progress_.setup_since_ns.load(), now = now_ns();
    ending.late = ending.late || now > give_up_ns_;
    ending.hung = ending.hung || (!ending.late && since_ns != 0 && now - since_ns > kSetupPatience_ns);
    return ending.hung || ending.late;
  }

  const Progress& progress_;
  int64_t give_up_ns_ = INT64_MAX;
  sigset_t signals_{}, before_{};
};

[[noreturn]] void end_by(int signal) {
  std::fflush(nullptr);
  std::signal(signal, SIG_DFL);
  sigset_t only;
  sigemptyset(&only);
  sigaddset(&only, signal);
  sigprocmask(SIG_UNBLOCK, &only, nullptr);
  raise(signal);
  _exit(128 + signal);
}

std::string how(const Ending& ending) {
  if (ending.hung) return fmt::format("does not return within {} s: an endless loop?", kSetupPatience_ns / kSecond);
  if (!WIFSIGNALED(ending.status)) return fmt::format("ends the process (exit {})", WEXITSTATUS(ending.status));
  return fmt::format("crashes: signal {} ({})", WTERMSIG(ending.status), strsignal(WTERMSIG(ending.status)));
}

/// What became of a child that did not come to the end of the command; the exit code, or this process ends as well.
int tell(const Ending& ending, const Progress& progress, const std::vector<std::string>& plugins) {
  const int signal = WIFSIGNALED(ending.status) ? WTERMSIG(ending.status) : 0;
  const bool in_setup = progress.setup_since_ns.load() != 0;
  const std::string where = in_setup ? fmt::format("{}: its setup", progress.node.text()) : "takt: error: the command";
  if (ending.late)
    fmt::print(stderr, "{} did not end within {} s of signal {} and was killed; plug-ins: {}\n", where,
               kEndPatience_ns / kSecond, ending.passed_on, fmt::join(plugins, ", "));
  if (ending.late || (signal != 0 && signal == ending.passed_on)) end_by(ending.passed_on);
  if (signal == SIGPIPE) end_by(signal);  // nobody reads any more
  fmt::print(stderr, "{} {}; plug-ins: {}\n", where, how(ending), fmt::join(plugins, ", "));
  command::tell_problems(1);
  return command::kBadInput;
}

std::set<pid_t> children() {
  std::ifstream list("/proc/thread-self/children");
  return {std::istream_iterator<pid_t>(list), {}};
}

}  // namespace

Orphans::Orphans() : others_(children()) {
  prctl(PR_GET_CHILD_SUBREAPER, &inherited_before_);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
}

void Orphans::bury() const {
  for (int tries = 0; tries < 1000; ++tries) {
    bool found = false;
    for (const pid_t child : children()) {
      if (others_.contains(child)) continue;
      found = true;
      kill(child, SIGKILL);
      waitpid(child, nullptr, WNOHANG);
    }
    if (!found) break;
    const timespec pause{0, 1'000'000};
    nanosleep(&pause, nullptr);
  }
  prctl(PR_SET_CHILD_SUBREAPER, inherited_before_);
}

int in_child(Registry& registry, const std::vector<std::string>& plugins, const std::function<int()>& command) {
  Progress& progress = share_progress();
  std::fflush(nullptr);
  Ending ending;
  {
    const Orphans orphans;
    Watch watch(progress);
    const pid_t parent = getpid(), child = fork();
    if (child < 0)
      return command::refuse(machine::explain("no process for the plug-ins", errno), command::kDeviceOrSystem);
    if (child == 0) {
      watch.restore();
      be_the_child(parent, registry, command);
    }
    ending = watch.until_end_of(child);
  }
  if (progress.ended.load() && WIFEXITED(ending.status)) return WEXITSTATUS(ending.status);
  return tell(ending, progress, plugins);
}

}  // namespace takt::plugin
