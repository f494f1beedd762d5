// SPDX-License-Identifier: Apache-2.0
// The one interface that each library is measured through: a medium carries messages along the edges of a graph, and
// each node holds its ends of it.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/peers/shape.hpp"
#include "rt/shm/transport.hpp"

namespace takt::bench {

/// How long a node sleeps before it looks whether the benchmark has ended. Longer than a period, so that no measured
/// frame pays for it.
inline constexpr int64_t kPatienceNs = 300'000'000;

/// What one node holds. Made and used by the thread (or process) that runs the node.
class Ends {
 public:
  virtual ~Ends() = default;
  /// Sleeps until the trigger edge brings a message and takes it; false after kPatienceNs without one.
  virtual bool wait() = 0;
  /// Takes the newest message of each side edge, without waiting; returns how many of them brought a new one.
  virtual size_t take_sides() = 0;
  /// Gets the memory for the next message.
  virtual void prepare() {}
  /// Hands the message to all consumers.
  virtual void publish() = 0;
  /// Gives back what wait() and take_sides() took.
  virtual void finish() {}
  /// What this machine's build of the library really does, e.g. whether memory is shared. Empty: nothing to tell.
  virtual std::string note() const { return {}; }
};

struct MediumPlan {
  GraphShape shape;
  uint32_t bytes = 0;  ///< of each message
  std::string id;      ///< unique on this machine while the medium lives; letters, digits, _
};

/// Made by the coordinator before it has forked or started anything; then open() once per node, in the node's process
/// or thread.
class Medium {
 public:
  virtual ~Medium() = default;
  virtual std::unique_ptr<Ends> open(size_t node) = 0;
  /// Pools this medium draws from the iceoryx daemon, which the coordinator runs for all media together.
  virtual std::vector<PortPlan> pools() const { return {}; }
  /// Tells, before the forks, what that daemon will serve: this medium's pools() lie at `first` of `all`.
  virtual void served(std::span<const PortPlan> all, size_t first, const std::string& domain) {
    static_cast<void>(all), static_cast<void>(first), static_cast<void>(domain);
  }
};

std::unique_ptr<Medium> make_futex(const MediumPlan& plan);       ///< threads only; the bare wake-up, no messages
std::unique_ptr<Medium> make_takt(const MediumPlan& plan);        ///< over iceoryx, as processes of a run have it
std::unique_ptr<Medium> make_takt_local(const MediumPlan& plan);  ///< over the runtime's own pools
std::unique_ptr<Medium> make_iceoryx(const MediumPlan& plan);
std::unique_ptr<Medium> make_zeromq_ipc(const MediumPlan& plan);
std::unique_ptr<Medium> make_zeromq_inproc(const MediumPlan& plan);
std::unique_ptr<Medium> make_cyclonedds(const MediumPlan& plan);
std::unique_ptr<Medium> make_roscpp(const MediumPlan& plan);

/// A library that a user might choose instead.
struct Peer {
  std::string name, package;  ///< Debian packages that bring it
  std::unique_ptr<Medium> (*processes)(const MediumPlan&) = nullptr;
  std::unique_ptr<Medium> (*threads)(const MediumPlan&) = nullptr;
  bool installed = false;
};

/// All that this suite knows; where one is not installed (or cannot start), says so on stderr, once in a process.
std::vector<Peer> peers();

/// Collects the pools of all media, tells each where its own lie in the daemon that this process is going to run, and
/// returns what that daemon must be made with. `first`: pools the caller has of its own.
std::vector<PortPlan> serve(std::span<const std::unique_ptr<Medium>> media, std::vector<PortPlan> first = {});

/// Pool sizes of Takt's and iceoryx's own contestants exceed the message by this: Cyclone DDS puts a header of its own
/// (less than half of this) into the chunk, and iceoryx serves each loan from the smallest pool that fits.
inline constexpr uint32_t kPoolGap = 1024;
/// Pool of an output whose messages, header included, have up to `bytes` (at least 128), for so many `readers`.
PortPlan pool_plan(const std::string& name, uint32_t bytes, uint32_t readers);

}  // namespace takt::bench
