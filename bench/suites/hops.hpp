// SPDX-License-Identifier: Apache-2.0
// The contestants of the transport suite: each carries one message from a sender to a listener that sleeps, and notes
// when it arrived. Listeners live in this process or in a forked one.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/instants.hpp"
#include "bench/peers/rung_graph.hpp"
#include "rt/sched/grant.hpp"
#include "rt/shm/local_transport.hpp"

namespace takt::bench {

/// takt: as a run has it, local within a process and iceoryx between processes; takt_local: local between them, too.
enum class Carrier : uint8_t { futex, takt, takt_local, iceoryx, peer };
enum class Place : uint8_t { same_worker, threads, processes };

/// True if messages are carried by a transport of Takt.
constexpr bool by_takt(Carrier carrier) { return carrier == Carrier::takt || carrier == Carrier::takt_local; }

/// What is to be carried, and how.
struct HopPlan {
  Carrier carrier = Carrier::futex;
  Place place = Place::threads;
  uint32_t bytes = 0;   ///< of the message; 0: only the wake-up
  bool second = false;  ///< null contestant: the same thing again under another name
  Peer peer{};          ///< Carrier::peer: the library
  std::string name() const;
};

/// Shared between sender and listener, across a fork.
struct Line {
  alignas(64) std::atomic<uint32_t> word{0};  ///< futex
  std::atomic<int64_t> sent_ns{0}, arrived_ns{0};
  std::atomic<uint32_t> sent{0}, answered{0};
};

inline constexpr size_t kMaxHops = 40;

struct Board {
  Line lines[kMaxHops];
  std::atomic<uint32_t> daemon_up{0}, listening{0}, stop{0};
  char domain[64] = {};
};

/// How sender and listeners are scheduled.
struct Conditions {
  std::string name;
  Reservation reservation;
};

/// All hops under one set of conditions: forks the listening process, starts the daemon, the listeners; ends it all.
class Course {
 public:
  /// Peers come last; one that does not start here is left out. The calling process must have no other threads. Throws
  /// CannotRun.
  Course(std::vector<HopPlan> hops, const Conditions& conditions);
  ~Course();
  Course(const Course&) = delete;
  Course& operator=(const Course&) = delete;

  const std::vector<HopPlan>& hops() const { return hops_; }
  /// Hops that are no peers'; they come first.
  size_t own() const { return own_; }
  /// Publishes one message, loaned before the time starts (a job loans early and publishes last). The caller then
  /// sleeps, so that listeners on its own CPU get to run.
  void send(size_t hop);
  /// From publication until the listener has the message in its hands, ns. Waits for it, however late it is: nothing is
  /// dropped. After two seconds it throws CannotRun; of a peer it is nothing then, and told by granted().
  std::optional<int64_t> taken_ns(size_t hop);
  /// What a peer says of itself beside its policy; empty for the others.
  std::string granted(size_t hop) const;

 private:
  class Sender;
  void listen_in_child();
  void make_peers();
  void start_peers();

  std::vector<HopPlan> hops_;
  Conditions conditions_;
  Board* board_ = nullptr;
  int child_ = -1;
  size_t own_ = 0;
  std::vector<PortPlan> ports_;  ///< of the own hops, then what peers need
  PoolFile pools_;               ///< behind local_, for the listening process
  std::unique_ptr<Transport> local_, across_;
  std::vector<std::unique_ptr<RungGraph>> peers_;  ///< of hops own_, own_ + 1 ...; must end before the daemon
  std::vector<std::unique_ptr<Sender>> senders_;
  struct Listeners;
  std::unique_ptr<Listeners> listeners_;
};

}  // namespace takt::bench
