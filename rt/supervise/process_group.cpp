// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/process_group.hpp"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "rt/supervise/hasten_end.hpp"

namespace takt {
namespace {

int run_member(const std::string& name, const std::function<int()>& body) {
  prctl(PR_SET_NAME, name.substr(0, 15).c_str());
  // A terminal or a service manager sends these to all processes at once. The supervisor ends the run, in order.
  for (const int end : {SIGINT, SIGHUP, SIGTERM}) signal(end, SIG_IGN);
  int code = 1;
  try {
    code = body();
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "takt: error: process %s: %s\n", name.c_str(), problem.what());
  } catch (...) {  // else it would go on in the supervisor's code above the fork
    std::fprintf(stderr, "takt: error: process %s: unknown exception\n", name.c_str());
  }
  std::fflush(nullptr);
  std::exit(code);  // not _exit: iceoryx removes its socket and lock in a static destructor
}

int64_t nanoseconds(const timeval& time) { return time.tv_sec * 1'000'000'000 + time.tv_usec * 1'000; }

void die_with(pid_t supervisor) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != supervisor) _exit(1);  // it died before the line above
}

}  // namespace

ProcessGroup::~ProcessGroup() {
  kill_all();
  for (const Member& member : members_) {
    if (member.pid <= 0) continue;
    for (bool ended = false; !ended; ended = waitpid(member.pid, nullptr, WNOHANG) != 0) {
      hasten_end(member.pid);
      const timespec pause{0, 1'000'000};
      nanosleep(&pause, nullptr);
    }
  }
}

void ProcessGroup::start(const std::string& name, const std::function<int()>& body) {
  std::fflush(nullptr);  // or both processes write what is buffered
  const pid_t supervisor = getpid(), pid = fork();
  if (pid < 0) throw std::runtime_error("process " + name + ": fork: " + std::strerror(errno));
  if (pid == 0) {
    die_with(supervisor);
    run_member(name, body);
  }
  members_.push_back({name, pid, body, false});
}

void ProcessGroup::prepare_restarts() {
  std::fflush(nullptr);
  nursery_ = std::make_unique<Nursery>([this, supervisor = getpid()](size_t process) {
    die_with(supervisor);
    return run_member(members_[process].name, members_[process].body);
  });
}

bool ProcessGroup::restart(size_t process) {
  if (!nursery_ || members_[process].pid != 0) return false;
  members_[process].pid = nursery_->fork_child(process);
  return members_[process].pid > 0;
}

int64_t ProcessGroup::cpu_ns(size_t process) const {
  clockid_t clock;
  timespec used{};
  if (members_[process].pid <= 0 || clock_getcpuclockid(members_[process].pid, &clock) != 0 ||
      clock_gettime(clock, &used) != 0)
    return 0;
  return used.tv_sec * 1'000'000'000 + used.tv_nsec;
}

std::optional<ProcessGroup::End> ProcessGroup::reap() {
  if (nursery_) nursery_->look();
  if (++looks_ % kLooksBetween == 0) hasten_ends();
  for (size_t i = 0; i < members_.size(); ++i) {
    int status = 0;
    rusage used{};
    if (members_[i].pid <= 0 || wait4(members_[i].pid, &status, WNOHANG, &used) != members_[i].pid) continue;
    const pid_t pid = std::exchange(members_[i].pid, 0);
    members_[i].ending = false;
    const int64_t cpu_ns = nanoseconds(used.ru_utime) + nanoseconds(used.ru_stime);
    if (WIFSIGNALED(status)) return End{i, pid, -1, WTERMSIG(status), cpu_ns};
    return End{i, pid, WEXITSTATUS(status), 0, cpu_ns};
  }
  return std::nullopt;
}

void ProcessGroup::hasten_ends() {
  for (Member& member : members_) {
    // Most end within one look; who does not waits for something.
    if (member.pid > 0 && std::exchange(member.ending, is_ending(member.pid)) && member.ending) hasten_end(member.pid);
  }
}

void ProcessGroup::kill_all() {
  for (const Member& member : members_)
    if (member.pid > 0) kill(member.pid, SIGKILL);
}

size_t ProcessGroup::alive() const {
  return static_cast<size_t>(
      std::count_if(members_.begin(), members_.end(), [](const Member& m) { return m.pid > 0; }));
}

}  // namespace takt
