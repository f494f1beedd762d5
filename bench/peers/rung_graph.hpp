// SPDX-License-Identifier: Apache-2.0
// A graph whose source runs when the coordinator rings: over some medium with one thread or process per node, or
// whatever a library brings along to run all of it.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bench/peers/medium.hpp"
#include "rt/sched/grant.hpp"

namespace takt::bench {

/// Shared between the coordinator and the nodes, across a fork.
struct GraphBoard {
  alignas(64) std::atomic<uint32_t> bell{0};
  std::atomic<int64_t> sent_ns{0}, arrived_ns{0};
  std::atomic<uint32_t> answered{0}, incomplete{0}, go{0}, ready{0}, stop{0};
  char granted[256] = {}, note[64] = {};  ///< written by the source before it is ready

  /// In the source: the message is about to be published. In the sink: it is in hand, and so many sides are not.
  void note_sent();
  void note_arrived(size_t missing_sides);
};

/// A contestant that runs one frame each time it is told to.
class RungGraph {
 public:
  enum class Place : uint8_t { threads, processes };
  /// Runs the whole graph on the calling thread: counts board.ready up, then a frame at each ring until board.stop.
  using Runner = std::function<void(GraphBoard&)>;

  /// One thread or process per node. Forks the processes, which then wait for start(); the calling process must have no
  /// other threads.
  RungGraph(std::string name, std::unique_ptr<Medium> medium, const GraphShape& shape, Place place,
            const Reservation& reservation);
  /// One thread that calls `runner` under the reservation.
  RungGraph(std::string name, Runner runner, const Reservation& reservation);
  ~RungGraph();
  RungGraph(const RungGraph&) = delete;
  RungGraph& operator=(const RungGraph&) = delete;

  /// Lets every node open its ends.
  void start();
  /// Waits for all nodes, then sends frames until they arrive one after the other. False if they do not.
  bool settle();
  /// Rings; the source then prepares its message, notes the instant and publishes.
  void send();
  /// From the source's publication to the sink's job start, ns. Waits two seconds; nothing if the frame was lost.
  std::optional<int64_t> taken_ns();
  /// CPU time of all its threads or processes since they were started.
  int64_t cpu_ns() const;

  const std::string& name() const { return name_; }
  /// After so many lost frames in all it is not worth asking further.
  bool given_up() const { return lost_ >= 5; }
  /// Policy, the medium's note, and what went wrong: lost frames, sinks that ran before a side message was there.
  std::string granted() const;

 private:
  void fork_node(size_t node, const GraphShape& shape);
  void run_node(size_t node, const GraphShape& shape);
  void take_reservation(bool first, bool inherit);
  bool all_ready();
  void wait_for_children();

  const std::string name_;
  std::unique_ptr<Medium> medium_;
  const Reservation reservation_;
  GraphBoard* board_ = nullptr;
  std::vector<std::function<void()>> bodies_;  ///< of the threads to start
  std::vector<std::thread> threads_;
  std::vector<int> children_, thread_ids_;
  uint32_t nodes_ = 0, answered_before_ = 0, lost_ = 0;
};

/// Threads of this process, ascending.
std::vector<int> thread_ids();
/// Those of `now` that are not in `before`; both ascending.
std::vector<int> new_thread_ids(const std::vector<int>& now, const std::vector<int>& before);
/// CPU time of threads of this process; one that ended counts nothing.
int64_t thread_cpu_ns(const std::vector<int>& ids);

/// A Runner over oneTBB's flow graph.
RungGraph::Runner onetbb_runner(const GraphShape& shape, uint32_t bytes, const Reservation& reservation);

}  // namespace takt::bench
