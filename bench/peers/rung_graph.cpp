// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/rung_graph.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <new>

#include "bench/futex.hpp"
#include "bench/instants.hpp"
#include "bench/suite.hpp"

namespace takt::bench {
namespace {

constexpr int kReadyMs = 20'000, kSettleMs = 10'000, kLostMs = 2000, kEndMs = 5000;
constexpr int kSettledFrames = 20;  // every chunk of every pool once, so that its pages are mapped

void pause_ms(int64_t ms) { sleep_until(now_ns() + ms * 1'000'000); }

void write_text(std::span<char> place, const std::string& text) {
  const size_t length = std::min(text.size(), place.size() - 1);
  std::memcpy(place.data(), text.data(), length);
  place[length] = 0;
}

GraphBoard* make_board() {
  void* memory = mmap(nullptr, sizeof(GraphBoard), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw CannotRun("no shared memory");
  return ::new (memory) GraphBoard;
}

}  // namespace

void GraphBoard::note_sent() { sent_ns.store(now_ns(), std::memory_order_relaxed); }

void GraphBoard::note_arrived(size_t missing_sides) {
  incomplete.fetch_add(missing_sides > 0, std::memory_order_relaxed);
  answered.fetch_add(1, std::memory_order_release);
}

RungGraph::RungGraph(std::string name, std::unique_ptr<Medium> medium, const GraphShape& shape, Place place,
                     const Reservation& reservation)
    : name_(std::move(name)),
      medium_(std::move(medium)),
      reservation_(reservation),
      board_(make_board()),
      nodes_(static_cast<uint32_t>(shape.nodes)) {
  std::fflush(nullptr);
  for (size_t node = 0; node < shape.nodes; ++node) {
    if (place == Place::processes) fork_node(node, shape);
    else
      bodies_.push_back([this, node, shape] {
        take_reservation(node == 0, false);
        run_node(node, shape);
      });
  }
}

RungGraph::RungGraph(std::string name, Runner runner, const Reservation& reservation)
    : name_(std::move(name)), reservation_(reservation), board_(make_board()), nodes_(1) {
  bodies_.push_back([this, runner = std::move(runner)] {
    take_reservation(true, false);
    runner(*board_);
  });
}

RungGraph::~RungGraph() {
  board_->stop.store(1);
  board_->go.store(1);
  wake(board_->bell);
  for (std::thread& thread : threads_) thread.join();
  wait_for_children();
  medium_.reset();
  munmap(board_, sizeof(GraphBoard));
}

void RungGraph::wait_for_children() {
  for (int waited = 0; waited < kEndMs; waited += 10) {
    std::erase_if(children_, [](int child) { return waitpid(child, nullptr, WNOHANG) != 0; });
    if (children_.empty()) return;
    pause_ms(10);
  }
  for (int child : children_) {  // some library does not let go
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
}

void RungGraph::fork_node(size_t node, const GraphShape& shape) {
  const pid_t child = fork();
  if (child < 0) throw CannotRun("fork failed");
  if (child > 0) return children_.push_back(child);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // what libraries say is no part of the report
  while (board_->go.load() == 0) pause_ms(2);
  int result = 0;
  try {
    take_reservation(node == 0, true);
    if (board_->stop.load() == 0) run_node(node, shape);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: node %zu: %s\n", name_.c_str(), node, error.what());
    result = 1;
  }
  std::exit(result);  // not _exit: iceoryx removes its socket and lock in a static destructor
}

/// `inherit`: threads that a library starts from here get the policy too.
void RungGraph::take_reservation(bool first, bool inherit) {
  const Grant grant = apply(reservation_);
  if (inherit && grant.policy == Policy::fixed) {
    const sched_param parameters{grant.priority};
    sched_setscheduler(0, SCHED_FIFO, &parameters);  // as granted, but without reset-on-fork
  }
  if (first) write_text(board_->granted, granted_text(grant));
}

void RungGraph::run_node(size_t node, const GraphShape& shape) {
  // One after the other: some libraries wake readers in the order in which they came, and where two branches begin that
  // decides which of them has the second CPU.
  while (board_->ready.load() < node && board_->stop.load() == 0) pause_ms(1);
  const std::unique_ptr<Ends> ends = medium_->open(node);
  const size_t sides = shape.sides(node).size();
  Bell bell(board_->bell);
  if (node == 0) write_text(board_->note, ends->note());
  board_->ready.fetch_add(1);
  while (board_->stop.load(std::memory_order_relaxed) == 0) {
    if (node == 0 ? !bell.wait(kPatienceNs) : !ends->wait()) continue;
    if (board_->stop.load(std::memory_order_relaxed) != 0) break;
    if (node == shape.sink()) {
      board_->arrived_ns.store(now_ns(), std::memory_order_relaxed);
      board_->note_arrived(sides - ends->take_sides());
    } else {
      if (sides > 0) ends->take_sides();
      ends->prepare();
      if (node == 0) board_->note_sent();
      ends->publish();
    }
    ends->finish();
  }
}

void RungGraph::start() {
  const std::vector<int> before = thread_ids();
  for (auto& body : bodies_) threads_.emplace_back(std::move(body));
  board_->go.store(1);
  if (bodies_.empty()) return;
  for (int waited = 0; board_->ready.load() < nodes_ && waited < kReadyMs; ++waited) pause_ms(1);
  settle();  // a library may start its threads at the first frame
  thread_ids_ = new_thread_ids(thread_ids(), before);
}

bool RungGraph::all_ready() {
  for (int waited = 0; waited < kReadyMs; ++waited) {
    if (board_->ready.load() == nodes_) return true;
    for (int child : children_) {
      siginfo_t ended{};
      if (waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid != 0)
        return false;
    }
    pause_ms(1);
  }
  return false;
}

bool RungGraph::settle() {
  if (!all_ready()) return false;
  int in_row = 0;
  for (const int64_t end = now_ns() + kSettleMs * 1'000'000LL; in_row < kSettledFrames && now_ns() < end;) {
    send();
    for (int waited = 0; waited < 200 && board_->answered.load() == answered_before_; ++waited) pause_ms(1);
    in_row = board_->answered.load() != answered_before_ ? in_row + 1 : 0;
  }
  pause_ms(20);
  board_->incomplete.store(0);
  return in_row == kSettledFrames;
}

void RungGraph::send() {
  answered_before_ = board_->answered.load();
  wake(board_->bell);
}

std::optional<int64_t> RungGraph::taken_ns() {
  for (int waited = 0; board_->answered.load(std::memory_order_acquire) == answered_before_; ++waited) {
    if (waited == kLostMs) {
      ++lost_;
      return std::nullopt;
    }
    pause_ms(1);
  }
  return board_->arrived_ns.load(std::memory_order_relaxed) - board_->sent_ns.load(std::memory_order_relaxed);
}

int64_t RungGraph::cpu_ns() const {
  int64_t sum = thread_cpu_ns(thread_ids_);
  for (int child : children_) {
    clockid_t clock{};
    if (clock_getcpuclockid(child, &clock) == 0) sum += clock_ns(clock);
  }
  return sum;
}

std::string RungGraph::granted() const {
  std::string text = board_->granted;
  if (board_->note[0] != 0) text += std::string(", ") + board_->note;
  if (board_->incomplete.load() > 0)
    text += ", " + std::to_string(board_->incomplete.load()) + " frames without a side message";
  if (lost_ > 0) text += ", " + std::to_string(lost_) + " frames lost" + (given_up() ? ", then given up" : "");
  return text;
}

std::vector<int> thread_ids() {
  std::vector<int> ids;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    const std::string name = entry.path().filename();
    int id = 0;
    if (std::from_chars(name.data(), name.data() + name.size(), id).ec == std::errc()) ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<int> new_thread_ids(const std::vector<int>& now, const std::vector<int>& before) {
  std::vector<int> added;
  std::set_difference(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(added));
  return added;
}

int64_t thread_cpu_ns(const std::vector<int>& ids) {
  int64_t sum = 0;
  for (int id : ids) {
    // The kernel's number for "CPU clock (2) of one thread (4)"; pthread_getcpuclockid makes the same from a handle.
    const auto clock = static_cast<clockid_t>((~static_cast<unsigned>(id) << 3) | 6U);
    sum += clock_ns(clock);
  }
  return sum;
}

}  // namespace takt::bench
