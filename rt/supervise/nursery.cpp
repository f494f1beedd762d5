// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/nursery.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "rt/machine/limits.hpp"

namespace takt {
namespace {

[[noreturn]] void refuse(const char* what) {
  throw std::runtime_error(machine::explain(std::string("restarts of processes") + what, errno));
}

/// The maker's end, and the other one.
bool make_line(std::array<int, 2>& ends) {
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) return false;
  const timeval patience{Nursery::kPatience_ns / 1'000'000'000, Nursery::kPatience_ns % 1'000'000'000 / 1'000};
  return setsockopt(ends[0], SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) == 0;
}

/// A message of one part, room for a descriptor beside it.
struct Letter {
  Letter(void* data, size_t bytes) : part{data, bytes} {
    head.msg_iov = &part;
    head.msg_iovlen = 1;
  }
  void make_room() {
    head.msg_control = control;
    head.msg_controllen = sizeof control;
  }
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  iovec part;
  msghdr head{};
};

/// `passed`: a descriptor that goes along, -1: none.
bool send_ask(int socket, void* ask, size_t bytes, int passed) {
  Letter letter(ask, bytes);
  if (passed >= 0) {
    letter.make_room();
    cmsghdr* first = CMSG_FIRSTHDR(&letter.head);
    first->cmsg_level = SOL_SOCKET;
    first->cmsg_type = SCM_RIGHTS;
    first->cmsg_len = CMSG_LEN(sizeof passed);
    std::memcpy(CMSG_DATA(first), &passed, sizeof passed);
  }
  return sendmsg(socket, &letter.head, MSG_NOSIGNAL | MSG_DONTWAIT) == static_cast<ssize_t>(bytes);
}

bool receive_ask(int socket, void* ask, size_t bytes, int& passed) {
  Letter letter(ask, bytes);
  letter.make_room();
  ssize_t got;
  while ((got = recvmsg(socket, &letter.head, MSG_CMSG_CLOEXEC)) < 0 && errno == EINTR) {
  }
  passed = -1;
  if (const cmsghdr* first = CMSG_FIRSTHDR(&letter.head); got > 0 && first != nullptr)
    std::memcpy(&passed, CMSG_DATA(first), sizeof passed);
  return got == static_cast<ssize_t>(bytes);
}

void wait_for_end(pid_t pid) {
  while (waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
  }
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

Nursery::Nursery(Body body, int priority) : body_(std::move(body)), priority_(priority), maker_(getpid()) {
  if (prctl(PR_SET_CHILD_SUBREAPER, 1) != 0) refuse("");
  void* memory =
      mmap(nullptr, sizeof(Order) * kOrders, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) refuse(": shared memory");
  orders_ = static_cast<Order*>(memory);
  for (size_t i = 0; i < kOrders; ++i) ::new (orders_ + i) Order;
  for (Hand& hand : hands_) hand = fork_first();
}

Nursery::~Nursery() {
  for (const Hand& hand : hands_)
    if (hand.pid != 0) close(hand.socket);  // which ends it
  for (const Hand& hand : hands_) {
    if (hand.pid == 0) continue;
    kill(hand.pid, SIGCONT);  // one that was stopped, too
    wait_for_end(hand.pid);
  }
  munmap(orders_, sizeof(Order) * kOrders);
}

Nursery::Hand Nursery::fork_first() {
  std::array<int, 2> ends{};
  if (!make_line(ends)) refuse("");
  const pid_t pid = fork();
  if (pid < 0) refuse(": fork");
  if (pid == 0) {
    close(ends[0]);
    serve(ends[1]);
  }
  close(ends[1]);
  return {pid, ends[0]};
}

void Nursery::serve(int answers) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_NAME, "takt-nursery");
  const sched_param real_time{priority_};
  if (priority_ > 0) sched_setscheduler(0, SCHED_FIFO, &real_time);
  for (const int end : {SIGINT, SIGHUP, SIGTERM}) signal(end, SIG_IGN);  // as the processes that it forks
  for (Hand& hand : hands_)  // of the maker: whoever keeps them open keeps the other one waiting for an end
    if (std::exchange(hand.pid, 0) != 0) close(hand.socket);
  Ask ask;
  int passed = -1;
  while (getppid() == maker_ && receive_ask(answers, &ask, sizeof ask, passed)) {
    const pid_t in_between = fork();
    if (in_between == 0) fork_once(ask, answers, passed);
    // Once that one is gone, the child is the maker's, who may wait for it from the answer on.
    if (in_between > 0) wait_for_end(in_between);
    if (passed >= 0) close(passed);
    send(answers, &ask.order, sizeof ask.order, MSG_NOSIGNAL);
  }
  _exit(0);
}

void Nursery::fork_once(const Ask& ask, int answers, int passed) {
  Order& order = orders_[ask.order % kOrders];
  const pid_t in_between = getpid(), forked = fork();
  if (forked != 0) {
    if (forked > 0) order.forked.store(forked);
    _exit(0);
  }
  close(answers);
  wait_for_adoption(in_between, maker_);
  if (order.withdrawn.load()) _exit(1);
  if (ask.child == kItself) serve(passed);
  _exit(body_(ask.child));
}

std::optional<pid_t> Nursery::ask(size_t child, int passed) {
  Ask ask{child, ++asked_};
  Order& order = orders_[ask.order % kOrders];
  order.forked.store(0);
  order.withdrawn.store(false);
  const int socket = hands_[0].socket;
  size_t answered = 0;
  bool silent = !send_ask(socket, &ask, sizeof ask, passed);
  while (!silent && answered != ask.order) {
    const ssize_t got = recv(socket, &answered, sizeof answered, 0);
    silent = got != static_cast<ssize_t>(sizeof answered) && !(got < 0 && errno == EINTR);
  }
  if (!silent) return order.forked.load();
  order.withdrawn.store(true);
  // It had forked before it fell silent: then the child may have looked before the line above.
  const pid_t forked = order.forked.load();
  return forked > 0 ? std::optional(forked) : std::nullopt;
}

pid_t Nursery::fork_child(size_t child) {
  look();
  for (size_t tries = 0; tries < hands_.size() && hands_[0].pid != 0; ++tries) {
    if (const auto pid = ask(child)) return *pid;
    bury(hands_[0]);
    let_spare_work();
  }
  return 0;
}

void Nursery::look() {
  for (Hand& hand : hands_)
    if (hand.pid != 0 && waitpid(hand.pid, nullptr, WNOHANG) == hand.pid) {
      close(hand.socket);
      hand = {};
      ++lost_;
    }
  let_spare_work();
  if (hands_[0].pid == 0 || hands_[1].pid != 0) return;
  std::array<int, 2> ends{};
  if (!make_line(ends)) return;
  const auto spare = ask(kItself, ends[1]);
  close(ends[1]);
  if (spare.value_or(0) > 0) hands_[1] = {*spare, ends[0]};
  else close(ends[0]);
  if (!spare) bury(hands_[0]);
}

void Nursery::bury(Hand& hand) {
  kill(hand.pid, SIGKILL);
  wait_for_end(hand.pid);
  close(hand.socket);
  hand = {};
  ++lost_;
}

void Nursery::let_spare_work() {
  if (hands_[0].pid == 0) std::swap(hands_[0], hands_[1]);
}

std::vector<pid_t> Nursery::pids() const {
  std::vector<pid_t> all;
  for (const Hand& hand : hands_)
    if (hand.pid != 0) all.push_back(hand.pid);
  return all;
}

}  // namespace takt
