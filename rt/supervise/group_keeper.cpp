// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/group_keeper.hpp"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "rt/machine/limits.hpp"
#include "rt/supervise/hasten_end.hpp"

namespace takt {
namespace {

constexpr int64_t kStep_ns = 5'000'000;

void wait_a_step(int64_t ns = kStep_ns) {
  const timespec pause{ns / 1'000'000'000, ns % 1'000'000'000};
  nanosleep(&pause, nullptr);
}

pid_t fork_group(const std::function<int()>& group) {
  std::fflush(nullptr);  // or both processes write what is buffered
  const pid_t keeper = getpid(), pid = fork();
  if (pid < 0) throw std::runtime_error(machine::explain("the group's process: fork", errno));
  if (pid > 0) return pid;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != keeper) _exit(1);
  const int code = group();
  std::fflush(nullptr);
  std::exit(code);
}

/// Of this process, which has one thread.
void kill_children() {
  std::ifstream children("/proc/thread-self/children");
  for (pid_t child; children >> child;) {
    kill(child, SIGKILL);
    hasten_end(child);
  }
}

/// They die with their supervisor, but for one that was just being forked or that has no tie to it; all of them belong
/// to this process then. Waits until the last one is gone: the next group works on the same board.
void bury_members() {
  pid_t buried = 0;
  for (int tries = 0; tries < 1000 && (buried >= 0 || errno != ECHILD); ++tries) {
    kill_children();
    buried = waitpid(-1, nullptr, WNOHANG);
    if (buried == 0) wait_a_step();
  }
}

}  // namespace

GroupKeeper::GroupKeeper(GroupSigns& signs, const Clock& clock, Options options)
    : signs_(signs), clock_(clock), options_(std::move(options)) {}

std::optional<int> GroupKeeper::keep(const std::function<int()>& group) {
  RestartPolicy policy(options_.restarts);
  while (true) {
    policy.started(clock_.now_ns());
    if (const auto code = watch(group)) return code;
    const auto again = policy.ended(clock_.now_ns());
    if (!again) return std::nullopt;
    wait_a_step(*again - clock_.now_ns());
  }
}

std::optional<int> GroupKeeper::watch(const std::function<int()>& group) {
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  signs_.heartbeat_ns.store(0);
  Silence silence;
  const pid_t pid = fork_group(group);
  GroupSigns::Loss loss;
  bool told = false;
  int status = 0;
  pid_t ended = 0;
  while ((ended = waitpid(pid, &status, WNOHANG)) == 0 || (ended < 0 && errno == EINTR)) {
    wait_a_step();
    if (!told && options_.stop_asked && options_.stop_asked()) {
      kill(pid, SIGTERM);
      told = true;
    }
    const int64_t heartbeat_ns = signs_.heartbeat_ns.load();
    const int64_t patience_ns = (signs_.ordinary.load() ? 3 : 1) * options_.silence_ns;
    if (silence.look(heartbeat_ns, clock_.now_ns()) <= patience_ns || loss.from_ns != 0) continue;
    loss.from_ns = heartbeat_ns;
    loss.cause = BoundedText<200>("the transport's daemon gave no sign of life");
    kill(pid, SIGKILL);  // its members go with it
  }
  bury_members();
  if (!WIFSIGNALED(status)) return WEXITSTATUS(status);
  if (options_.clean_up) options_.clean_up(pid);
  if (loss.from_ns == 0) {
    loss.from_ns = clock_.now_ns();
    loss.cause = BoundedText<200>(std::string("the supervisor was ended by signal ") +
                                  std::to_string(WTERMSIG(status)) + " (" + strsignal(WTERMSIG(status)) + ")");
  }
  if (told) return 128 + WTERMSIG(status);  // it was to end anyway
  signs_.newest_loss = loss;
  signs_.losses.fetch_add(1);
  if (options_.say) options_.say(std::string(loss.cause.text()) + "; all processes are started again");
  return std::nullopt;
}

}  // namespace takt
