// SPDX-License-Identifier: Apache-2.0
#include "bench/suites/hops.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <thread>

#include "bench/futex.hpp"
#include "bench/suite.hpp"
#include "iceoryx_posh/popo/untyped_publisher.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "iceoryx_posh/popo/wait_set.hpp"
#include "rt/shm/iceoryx_layout.hpp"
#include "rt/shm/iceoryx_transport.hpp"

namespace takt::bench {
namespace {

constexpr int64_t kEver = std::numeric_limits<int64_t>::max();

void arrived(Line& line) {
  line.arrived_ns.store(now_ns(), std::memory_order_relaxed);
  line.answered.fetch_add(1, std::memory_order_release);
}

/// Takes the newest message, reads from it and lets it go.
bool take_newest(Reader& reader, Line* line) {
  std::array<Candidate, 1> newest;
  if (reader.list(kEver, newest) == 0) return false;
  Held held = reader.take(newest[0].sequence);
  if (!held) return false;
  if (line != nullptr) arrived(*line);
  reader.release(held);
  return true;
}

iox::capro::ServiceDescription raw_service(const Board& board, size_t hop) {
  using Name = iox::capro::IdString_t;
  return {Name("raw"), Name(iox::cxx::TruncateToCapacity, board.domain),
          Name(iox::cxx::TruncateToCapacity, std::to_string(hop).c_str())};
}

void listen_futex(Board& board, size_t hop, Reader* reader) {
  Line& line = board.lines[hop];
  for (uint32_t seen = 0;;) {
    while (line.word.load(std::memory_order_acquire) == seen) wait_while(line.word, seen);
    seen = line.word.load(std::memory_order_acquire);
    if (board.stop.load() != 0) return;
    if (reader == nullptr) arrived(line);
    else take_newest(*reader, &line);
  }
}

/// As an iceoryx user would write it: a wait set and an untyped subscriber.
void listen_raw(Board& board, size_t hop) {
  iox::popo::SubscriberOptions options;
  options.queueCapacity = 2;
  iox::popo::UntypedSubscriber subscriber(raw_service(board, hop), options);
  iox::popo::WaitSet<4> waits;
  waits.attachState(subscriber, iox::popo::SubscriberState::HAS_DATA).or_else([](auto) { std::terminate(); });
  board.listening.fetch_add(1);
  while (true) {
    waits.timedWait(iox::units::Duration::fromMilliseconds(500));
    if (board.stop.load() != 0) return;
    subscriber.take().and_then([&](const void* chunk) {
      arrived(board.lines[hop]);
      subscriber.release(chunk);
    });
  }
}

}  // namespace

std::string HopPlan::name() const {
  const char* where = place == Place::same_worker ? "same_worker" : place == Place::threads ? "threads" : "processes";
  std::string name = carrier == Carrier::futex        ? "futex"
                     : carrier == Carrier::takt       ? "takt"
                     : carrier == Carrier::takt_local ? "takt_local"
                     : carrier == Carrier::iceoryx    ? "iceoryx"
                                                      : peer.name;
  name += '_';
  name += where;
  if (bytes > 0) name += '_' + std::to_string(bytes);
  if (second) name += "_again";
  return name;
}

class Course::Sender {
 public:
  Sender(const HopPlan& plan, Board& board, size_t hop, std::unique_ptr<Writer> writer, std::unique_ptr<Reader> reader,
         uint32_t raw_bytes)
      : plan_(plan),
        line_(board.lines[hop]),
        writer_(std::move(writer)),
        reader_(std::move(reader)),
        raw_bytes_(raw_bytes) {
    if (plan.carrier == Carrier::iceoryx) raw_ = std::make_unique<iox::popo::UntypedPublisher>(raw_service(board, hop));
  }

  void send() {
    if (plan_.carrier == Carrier::iceoryx) {
      raw_->loan(raw_bytes_, iceoryx_limit::alignment).and_then([&](void* chunk) {
        start();
        raw_->publish(chunk);
      });
      return;
    }
    if (by_takt(plan_.carrier) && writer_->loan() == nullptr) return;
    start();
    if (by_takt(plan_.carrier)) writer_->publish(0, 0, 0);
    if (plan_.place == Place::same_worker) take_newest(*reader_, &line_);
    else wake(line_.word);
  }

 private:
  void start() {
    line_.sent.fetch_add(1, std::memory_order_relaxed);
    line_.sent_ns.store(now_ns(), std::memory_order_relaxed);
  }

  const HopPlan plan_;
  Line& line_;
  std::unique_ptr<Writer> writer_;
  std::unique_ptr<Reader> reader_;
  std::unique_ptr<iox::popo::UntypedPublisher> raw_;
  const uint32_t raw_bytes_;
};

struct Course::Listeners {
  Board& board;
  std::vector<std::unique_ptr<Reader>> readers;
  std::vector<std::thread> threads;
  std::vector<size_t> hops;
  explicit Listeners(Board& b) : board(b) {}

  void start(size_t hop, const HopPlan& plan, const Conditions& conditions, std::unique_ptr<Reader> reader) {
    Reader* mine = readers.emplace_back(std::move(reader)).get();
    hops.push_back(hop);
    threads.emplace_back([this, hop, plan, conditions, mine] {
      apply(conditions.reservation);
      if (plan.carrier == Carrier::iceoryx) return listen_raw(board, hop);
      board.listening.fetch_add(1);
      listen_futex(board, hop, mine);
    });
  }
  ~Listeners() {
    for (size_t hop : hops) wake(board.lines[hop].word);
    for (std::thread& thread : threads) thread.join();
  }
};

Course::Course(std::vector<HopPlan> hops, const Conditions& conditions)
    : hops_(std::move(hops)), conditions_(conditions) {
  if (hops_.size() > kMaxHops) throw CannotRun("more than " + std::to_string(kMaxHops) + " contestants");
  own_ = static_cast<size_t>(
      std::find_if(hops_.begin(), hops_.end(), [](const HopPlan& hop) { return hop.carrier == Carrier::peer; }) -
      hops_.begin());
  for (size_t i = 0; i < own_; ++i) ports_.push_back(pool_plan(hops_[i].name(), hops_[i].bytes + kPoolGap, 1));
  void* memory = mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw CannotRun("no shared memory");
  board_ = ::new (memory) Board;
  make_peers();
  std::fflush(nullptr);
  child_ = fork();
  if (child_ < 0) throw CannotRun("fork failed");
  if (child_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    listen_in_child();
    std::exit(0);  // not _exit: iceoryx removes its socket and lock in a static destructor
  }
  local_ = make_local_transport(std::span(ports_).first(own_), pools_);
  across_ = make_iceoryx_transport(ports_);
  std::strncpy(board_->domain, iceoryx_domain(getpid()).c_str(), sizeof board_->domain - 1);
  const IceoryxLayout layout = IceoryxLayout::of(ports_);
  listeners_ = std::make_unique<Listeners>(*board_);
  uint32_t expected = 0;
  for (size_t i = 0; i < own_; ++i) {
    const HopPlan& hop = hops_[i];
    const bool over_iceoryx = hop.place == Place::processes && hop.carrier != Carrier::takt_local;
    Transport& transport = over_iceoryx ? *across_ : *local_;
    const bool carries = by_takt(hop.carrier);
    senders_.push_back(std::make_unique<Sender>(hop, *board_, i, carries ? transport.make_writer(i) : nullptr,
                                                hop.place == Place::same_worker ? transport.make_reader(i) : nullptr,
                                                layout.pools[layout.pool_of_port[i]].loan_bytes));
    expected += hop.place != Place::same_worker;
    if (hop.place == Place::threads)
      listeners_->start(i, hop, conditions_, carries ? transport.make_reader(i) : nullptr);
  }
  board_->daemon_up.store(1);
  for (int tries = 0; board_->listening.load() < expected; ++tries) {
    if (tries > 5000) throw CannotRun("the listening process did not start");
    sleep_until(now_ns() + 1'000'000);
  }
  start_peers();
}

void Course::make_peers() {
  std::vector<std::unique_ptr<Medium>> media;
  for (size_t i = own_; i < hops_.size(); ++i) {
    const std::string id = hops_[i].name() + "_" + std::to_string(getpid());
    media.push_back(hops_[i].peer.processes({one_hop(), hops_[i].bytes, id}));
  }
  ports_ = serve(media, ports_);
  for (size_t i = own_; i < hops_.size(); ++i)
    peers_.push_back(std::make_unique<RungGraph>(hops_[i].name(), std::move(media[i - own_]), one_hop(),
                                                 RungGraph::Place::processes, conditions_.reservation));
}

void Course::start_peers() {
  for (auto& peer : peers_) peer->start();
  for (size_t i = peers_.size(); i-- > 0;) {
    if (peers_[i]->settle()) continue;
    std::fprintf(stderr, "peer %s: did not start here; left out\n", peers_[i]->name().c_str());
    peers_.erase(peers_.begin() + static_cast<std::ptrdiff_t>(i));
    hops_.erase(hops_.begin() + static_cast<std::ptrdiff_t>(own_ + i));
  }
}

void Course::listen_in_child() {
  while (board_->daemon_up.load() == 0) sleep_until(now_ns() + 1'000'000);
  const auto across = join_iceoryx_transport(ports_, board_->domain);
  const auto local = join_local_transport(std::span(ports_).first(own_), pools_);
  Listeners listeners(*board_);
  for (size_t i = 0; i < own_; ++i) {
    const Carrier carrier = hops_[i].carrier;
    if (hops_[i].place != Place::processes) continue;
    listeners.start(i, hops_[i], conditions_,
                    carrier == Carrier::takt         ? across->make_reader(i)
                    : carrier == Carrier::takt_local ? local->make_reader(i)
                                                     : nullptr);
  }
  while (board_->stop.load() == 0) sleep_until(now_ns() + 20'000'000);
}

Course::~Course() {
  board_->stop.store(1);
  waitpid(child_, nullptr, 0);
  listeners_.reset();
  senders_.clear();
  peers_.clear();
  across_.reset();
  local_.reset();
  munmap(board_, sizeof(Board));
}

void Course::send(size_t hop) {
  if (hop < own_) senders_[hop]->send();
  else if (!peers_[hop - own_]->given_up()) peers_[hop - own_]->send();
}

std::optional<int64_t> Course::taken_ns(size_t hop) {
  if (hop >= own_) {
    RungGraph& peer = *peers_[hop - own_];
    return peer.given_up() ? std::nullopt : peer.taken_ns();
  }
  const Line& line = board_->lines[hop];
  for (int tries = 0; line.answered.load(std::memory_order_acquire) != line.sent.load(std::memory_order_relaxed);
       ++tries) {
    if (tries == 2000) throw CannotRun("a message of " + hops_[hop].name() + " never arrived");
    sleep_until(now_ns() + 1'000'000);
  }
  return line.arrived_ns.load(std::memory_order_relaxed) - line.sent_ns.load(std::memory_order_relaxed);
}

std::string Course::granted(size_t hop) const { return hop < own_ ? std::string() : peers_[hop - own_]->granted(); }

}  // namespace takt::bench
