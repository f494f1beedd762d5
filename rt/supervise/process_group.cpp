// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/process_group.hpp"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace takt {
namespace {

[[noreturn]] void become_member(const std::string& name, pid_t supervisor, const std::function<int()>& body) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != supervisor) _exit(1);  // it died before the line above
  prctl(PR_SET_NAME, name.substr(0, 15).c_str());
  signal(SIGINT, SIG_IGN);
  signal(SIGHUP, SIG_IGN);
  signal(SIGTERM, SIG_DFL);
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

}  // namespace

ProcessGroup::~ProcessGroup() {
  kill_all();
  for (const Member& member : members_) {
    if (member.pid <= 0) continue;
    while (waitpid(member.pid, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
}

void ProcessGroup::start(const std::string& name, const std::function<int()>& body) {
  std::fflush(nullptr);  // or both processes write what is buffered
  const pid_t supervisor = getpid(), pid = fork();
  if (pid < 0) throw std::runtime_error("process " + name + ": fork: " + std::strerror(errno));
  if (pid == 0) become_member(name, supervisor, body);
  members_.push_back({name, pid});
}

std::optional<ProcessGroup::End> ProcessGroup::reap() {
  for (size_t i = 0; i < members_.size(); ++i) {
    int status = 0;
    if (members_[i].pid <= 0 || waitpid(members_[i].pid, &status, WNOHANG) != members_[i].pid) continue;
    const pid_t pid = std::exchange(members_[i].pid, 0);
    if (WIFSIGNALED(status)) return End{i, pid, -1, WTERMSIG(status)};
    return End{i, pid, WEXITSTATUS(status), 0};
  }
  return std::nullopt;
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
