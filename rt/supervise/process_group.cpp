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

#include "rt/machine/limits.hpp"
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
    std::fprintf(stderr, "takt: error: process %s: %s\n", name.c_str(), machine::explain(problem).c_str());
  } catch (...) {  // else it would go on in the supervisor's code above the fork
    std::fprintf(stderr, "takt: error: process %s: unknown exception\n", name.c_str());
  }
  std::fflush(nullptr);
  std::exit(code);  // not _exit: iceoryx removes its socket and lock in a static destructor
}

int64_t nanoseconds(const timeval& time) { return time.tv_sec * 1'000'000'000 + time.tv_usec * 1'000; }

int64_t cpu_ns_of(pid_t pid) {
  clockid_t clock;
  timespec used{};
  if (pid <= 0 || clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &used) != 0) return 0;
  return used.tv_sec * 1'000'000'000 + used.tv_nsec;
}

/// For its end, which it hastens.
void wait_for(pid_t pid) {
  for (bool ended = pid <= 0; !ended; ended = waitpid(pid, nullptr, WNOHANG) != 0) {
    hasten_end(pid);
    const timespec pause{0, 1'000'000};
    nanosleep(&pause, nullptr);
  }
}

void die_with(pid_t supervisor) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != supervisor) _exit(1);  // it died before the line above
}

}  // namespace

ProcessGroup::~ProcessGroup() {
  kill_all();
  for (const Member& member : members_) wait_for(member.pid), wait_for(member.spare);
  for (const Dead& dead : dead_) wait_for(dead.pid);
}

void ProcessGroup::start(const std::string& name, const std::function<int()>& body, const std::function<int()>& spare) {
  std::fflush(nullptr);  // or both processes write what is buffered
  const pid_t supervisor = getpid(), pid = fork();
  if (pid < 0) throw std::runtime_error(machine::explain("process " + name + ": fork", errno));
  if (pid == 0) {
    die_with(supervisor);
    run_member(name, body);
  }
  members_.push_back({name, pid, body, spare, 0});
}

void ProcessGroup::prepare_restarts(bool real_time) {
  std::fflush(nullptr);
  const auto body = [this, real_time, supervisor = getpid()](size_t child) {
    die_with(supervisor);
    const Member& member = members_[child % members_.size()];
    const bool spare = child >= members_.size();
    if (real_time && spare) demote_thread(0);
    if (real_time && !spare) lift_thread(0, kLowestPriority);
    if (!spare) return run_member(member.name, member.body);
    return run_member(member.name.substr(0, 9) + "-spare", member.spare_body);
  };
  nursery_ = std::make_unique<Nursery>(body, real_time ? kSupervisorPriority : 0);
}

bool ProcessGroup::restart(size_t process) {
  if (!nursery_ || members_[process].pid != 0) return false;
  members_[process].pid = nursery_->fork_child(process);
  return members_[process].pid > 0;
}

bool ProcessGroup::start_spare(size_t process) {
  Member& member = members_[process];
  if (!nursery_ || !member.spare_body || member.spare > 0) return false;
  member.spare = nursery_->fork_child(members_.size() + process);
  return member.spare > 0;
}

bool ProcessGroup::take_over(size_t process) {
  Member& member = members_[process];
  if (member.pid > 0 || member.spare <= 0) return false;
  member.pid = std::exchange(member.spare, 0);
  return true;
}

std::optional<ProcessGroup::End> ProcessGroup::early_end(size_t process) {
  Member& member = members_[process];
  if (member.pid <= 0) return std::nullopt;
  const auto signal = signal_of_dead(member.pid);
  if (!signal) {
    hasten_end(member.pid);  // a thread may wait for its reservation before it can end
    return std::nullopt;
  }
  dead_.push_back({process, std::exchange(member.pid, 0)});
  return End{process, dead_.back().pid, -1, *signal};
}

void ProcessGroup::end_spare(size_t process) const {
  if (members_[process].spare > 0) kill(members_[process].spare, SIGKILL);
}

int64_t ProcessGroup::cpu_ns(size_t process) const { return cpu_ns_of(members_[process].pid); }
int64_t ProcessGroup::spare_cpu_ns(size_t process) const { return cpu_ns_of(members_[process].spare); }

std::optional<ProcessGroup::End> ProcessGroup::reap(pid_t pid) {
  int status = 0;
  rusage used{};
  if (pid <= 0 || wait4(pid, &status, WNOHANG, &used) != pid) return std::nullopt;
  End end{0, pid, -1, 0, nanoseconds(used.ru_utime) + nanoseconds(used.ru_stime)};
  if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  else end.code = WEXITSTATUS(status);
  return end;
}

std::optional<ProcessGroup::End> ProcessGroup::reap() {
  if (nursery_) nursery_->look();
  if (++looks_ % kLooksBetween == 0) hasten_ends();
  for (size_t i = 0; i < members_.size(); ++i) {
    Member& member = members_[i];
    if (auto end = reap(member.pid)) {
      end->process = i;
      member.pid = 0;
      return end;
    }
    if (auto end = reap(member.spare)) {
      end->process = i;
      end->of = End::spare;
      member.spare = 0;
      return end;
    }
  }
  for (auto dead = dead_.begin(); dead != dead_.end(); ++dead) {
    auto end = reap(dead->pid);
    if (!end) continue;
    end->process = dead->process;
    end->of = End::cleared;
    dead_.erase(dead);
    return end;
  }
  return std::nullopt;
}

void ProcessGroup::hasten_ends() {
  for (Member& member : members_) {
    if (member.pid > 0) hasten_end(member.pid);
  }
  for (const Dead& dead : dead_) hasten_end(dead.pid);
}

void ProcessGroup::kill_all() {
  for (size_t process = 0; process < members_.size(); ++process) {
    if (members_[process].pid > 0) kill(members_[process].pid, SIGKILL);
    end_spare(process);
  }
}

size_t ProcessGroup::alive() const {
  size_t count = dead_.size();
  for (const Member& member : members_) count += (member.pid > 0 ? 1u : 0u) + (member.spare > 0 ? 1u : 0u);
  return count;
}

}  // namespace takt
