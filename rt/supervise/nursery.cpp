// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/nursery.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <string>
#include <utility>

namespace takt {
namespace {

template <class T>
bool send_one(int socket, const T& value) {
  return send(socket, &value, sizeof value, MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof value);
}

template <class T>
bool receive_one(int socket, T& value) {
  ssize_t got;
  while ((got = recv(socket, &value, sizeof value, 0)) < 0 && errno == EINTR) {
  }
  return got == static_cast<ssize_t>(sizeof value);
}

/// An orphan goes to its nearest subreaper: the maker. Not before the process in between is gone.
void wait_for_adoption(pid_t in_between, pid_t maker) {
  while (getppid() == in_between) {
    const timespec pause{0, 100'000};
    nanosleep(&pause, nullptr);
  }
  if (getppid() != maker) _exit(1);  // it died meanwhile
}

}  // namespace

Nursery::Nursery(Body body) : body_(std::move(body)), maker_(getpid()) {
  std::array<int, 2> ends{};
  if (prctl(PR_SET_CHILD_SUBREAPER, 1) != 0 || socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw std::runtime_error(std::string("restarts of processes: ") + std::strerror(errno));
  asks_ = ends[0], answers_ = ends[1];
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error(std::string("restarts of processes: fork: ") + std::strerror(errno));
  if (pid_ == 0) serve();
  close(std::exchange(answers_, -1));
}

Nursery::~Nursery() {
  close(asks_);  // which ends it
  if (answers_ >= 0) return;
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void Nursery::serve() {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_NAME, "takt-nursery");
  signal(SIGINT, SIG_IGN);
  signal(SIGHUP, SIG_IGN);
  signal(SIGTERM, SIG_IGN);
  close(asks_);
  void* box = mmap(nullptr, sizeof(pid_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (box == MAP_FAILED) _exit(1);
  auto& pid = *static_cast<volatile pid_t*>(box);
  for (size_t child = 0; getppid() == maker_ && receive_one(answers_, child);) {
    pid = 0;
    const pid_t in_between = fork();
    if (in_between == 0) fork_once(child, pid);
    // Once that one is gone, the child is the maker's, who may wait for it from the answer on.
    while (in_between > 0 && waitpid(in_between, nullptr, 0) < 0 && errno == EINTR) {
    }
    send_one(answers_, pid_t{pid});
  }
  _exit(0);
}

void Nursery::fork_once(size_t child, volatile pid_t& pid) const {
  const pid_t in_between = getpid(), forked = fork();
  if (forked != 0) {
    if (forked > 0) pid = forked;
    _exit(0);
  }
  close(answers_);
  wait_for_adoption(in_between, maker_);
  _exit(body_(child));
}

pid_t Nursery::fork_child(size_t child) {
  pid_t pid = 0;
  return send_one(asks_, child) && receive_one(asks_, pid) ? pid : 0;
}

}  // namespace takt
