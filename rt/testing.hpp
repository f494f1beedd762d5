// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/testing.hpp>: core, experimental.
// Runs one node without a graph: for the unit tests of a node, in any test framework.
//
//   takt::NodeTest<Doubler> test;
//   test.set("factor", 2.0);
//   test.put("in", 5, [](Number& message) { message.value = 21; });  // stamp 5 ns
//   test.run();
//   CHECK(test.out<Number>("out")->value == 42);
//   CHECK(test.stamp_ns("out") == 5);
//   CHECK(test.allocations() == 0);  // of this job; link takt_allocation_counter
//
// Time is virtual: it stands while a job runs, and each run() is the next planned release. Nothing sleeps, so that a
// test gives the same result on every machine. A wrong use (no such port, another message type) throws
// std::logic_error with the valid choices. One thread at a time.
#pragma once
#include <array>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rt/log_line.hpp"
#include "rt/memory/job_calls.hpp"
#include "rt/node.hpp"

namespace takt::test {

/// One message in plain memory, as the transport would place it in a chunk. Starts empty.
class Chunk {
 public:
  Chunk(const MessageType& type, const Capacity& capacity);
  MessageHeader& header() { return *header_; }
  void* message() { return header_ + 1; }
  /// Empties the message: fields have their defaults, arrays no elements.
  void clear() { type_->place(message(), capacity_); }

 private:
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  const MessageType* type_;
  Capacity capacity_;
  std::unique_ptr<void, Free> memory_;
  MessageHeader* header_;
};

/// A message of type T to fill: `Box<Text> box{{.count = 64}}; box->size = 3;`
template <class T>
class Box : public Chunk {
 public:
  explicit Box(const Capacity& capacity = {}) : Chunk(MessageType::of<T>(), capacity) {}
  T& operator*() { return *static_cast<T*>(Chunk::message()); }
  T* operator->() { return &**this; }
};

/// Receives what a node sends on one output: gives the same chunk for each loan and notes whether the job sent it.
/// Attached as long as it lives.
class ChunkWriter : public Writer {
 public:
  explicit ChunkWriter(OutputPort& port, bool read = true);
  MessageHeader* loan() override;
  void publish(int64_t, int64_t, int64_t) override {}
  void discard() override {}
  bool repeat(int64_t, int64_t) override { return false; }
  WriterStatistics statistics() const override { return {}; }

  const OutputPort& port() const { return *port_; }
  const MessageHeader* loaned() { return &chunk_.header(); }
  bool sent() const;         ///< since the last clear()
  int64_t stamp_ns() const;  ///< of the message sent
  void clear();              ///< before each job
  bool refuses = false;      ///< a second message between two clear(), as the runtime does in one job
  uint64_t refused = 0;      ///< how many

 protected:
  Chunk chunk_;

 private:
  friend class NodeRun;
  OutputPort* port_;
};

template <class T>
class BoxWriter final : public ChunkWriter {
 public:
  using ChunkWriter::ChunkWriter;
  T& message() { return *static_cast<T*>(chunk_.message()); }
};

/// Ports and parameters by name.
InputPort& input(Node& node, std::string_view name);
OutputPort& output(Node& node, std::string_view name);
/// Sets a parameter, as the graph file would before start. Numbers are in the unit of the parameter.
void set(Node& node, std::string_view name, const ParamValue& value);

/// The port holds this message in the next job; `sequence` above the last one makes it new.
void latch(InputPort& port, Chunk& chunk, int64_t stamp_ns, uint64_t sequence, size_t slot = 0);

/// Stands at 0. At namespace scope: a local static registers its destructor on first use, which allocates now and then,
/// and tests count the allocations of their first job.
inline const VirtualClock standing_clock;

/// One job at instant 0, with what is latched. False if it said no_result().
bool run(Node& node, uint64_t index = 0);
void set_up(Node& node, const std::filesystem::path& output = ".");

/// The part of NodeTest that does not depend on the node's class.
class NodeRun {
 public:
  /// The instant of the first release, ns; stamps before it are older than the run.
  static constexpr int64_t kEpochNs = 1'000'000'000;

  explicit NodeRun(std::unique_ptr<Node> node);
  ~NodeRun();

  // Before the first job, which sets the node up.

  /// A parameter, as the graph file would set it; numbers in the unit of the parameter. A live one may be set between
  /// jobs too.
  void set(std::string_view name, const ParamValue& value);
  /// Declares how large the messages of an input are; types with arrays need it. It connects an optional input:
  /// required ones are always connected.
  void connect(std::string_view input, const Capacity& capacity = {});
  /// How many messages the input latches (1 to InputPort::kMaxDepth; default 1).
  void depth(std::string_view input, size_t messages);
  /// Nobody reads this output: its connected() is false.
  void leave_unread(std::string_view output);
  /// Releases per second; default 10/s.
  void rate(Rate releases) { rate_ = releases; }
  /// Files that parameters name are relative to `read` (default: the current folder); finish() may write into `write`.
  void folders(std::filesystem::path read, std::filesystem::path write) {
    read_ = std::move(read), write_ = std::move(write);
  }
  void seed(uint64_t value) { seed_ = value; }
  /// What the output published last before a restart (Output::handed_over), to be filled before the first job.
  template <class M>
  M& hand_over(std::string_view output, const Capacity& capacity = {}) {
    return *static_cast<M*>(hand_over(output, MessageType::of<M>(), capacity));
  }
  /// Calls setup() and start() of the node now; the first job does it otherwise. What setup() throws (SetupError) comes
  /// out here.
  void start();

  // Between jobs.

  /// Puts a message into an input, to be filled: the jobs from now on latch it, and the first of them sees it as new.
  template <class M>
  M& put(std::string_view input, int64_t stamp_ns) {
    return *static_cast<M*>(put(input, stamp_ns, MessageType::of<M>()));
  }
  /// ... and fills it: `test.put("in", stamp_ns, [](Text& m) { m.size = 3; })`.
  template <class Fill>
  void put(std::string_view input, int64_t stamp_ns, Fill fill) {
    fill_message(input, stamp_ns, std::function(std::move(fill)));
  }
  /// What the input holds is too old from now on, until the next put(). An input that never got a message is stale.
  void make_stale(std::string_view input);
  /// Nothing is latched any more.
  void empty(std::string_view input);
  /// Quality level of the next jobs: an index into the node's Levels.
  void level(int index);
  void mode(std::string name) { mode_ = std::move(name); }
  /// From release to deadline, ns; default: one period.
  void deadline(int64_t after_release_ns) { deadline_ns_ = after_release_ns; }
  /// Lets time pass; a job then starts later than its release. Never backwards.
  void advance_to(int64_t instant_ns) { clock_.advance_to(instant_ns); }
  int64_t now_ns() const { return clock_.now_ns(); }

  /// The job of the next release. False if it said no_result().
  bool run();
  /// A job released at that instant, as one that follows a message is. False if it said no_result().
  bool run_at(int64_t release_ns);
  /// Calls finish() of the node.
  void finish() { node_->finish(); }

  // What the last job did.

  /// The message it sent, null if it sent none. Valid until the next job.
  template <class M>
  const M* out(std::string_view output) {
    return static_cast<const M*>(sent(output, MessageType::of<M>()));
  }
  /// Stamp of the message it sent, ns. Throws std::logic_error if it sent none.
  int64_t stamp_ns(std::string_view output);
  /// The job itself: what it said of its results, its device, the end of its data. Throws before the first job.
  const Job& job() const;
  /// What it said (Job::log), in its order. None is dropped before the tenth of a level, and the time between jobs
  /// counts as in a run.
  std::vector<LogLine> log() const;
  /// Heap blocks and mappings that it took. Throws std::logic_error if this program cannot count them because it is not
  /// linked with takt_allocation_counter; 0 under a sanitizer, which has a malloc of its own.
  uint64_t allocations() const;
  /// Calls that no job should make (JobCall) and that Node::may() does not declare: "malloc 2, file 1"; empty if there
  /// were none. Throws like allocations().
  std::string forbidden_calls() const;

 protected:
  std::unique_ptr<Node> node_;

 private:
  struct Message {
    Chunk chunk;
    int64_t stamp_ns;
    uint64_t sequence;
  };
  struct Latched {
    size_t depth = 1;
    bool stale = true;
    uint64_t sequence = 0, seen = 0;
    std::deque<Message> messages;  ///< oldest first, at most `depth`
  };

  template <class R, class M>
  void fill_message(std::string_view input, int64_t stamp_ns, const std::function<R(M&)>& fill) {
    fill(put<M>(input, stamp_ns));
  }
  void* put(std::string_view input, int64_t stamp_ns, const MessageType& type);
  void* hand_over(std::string_view output, const MessageType& type, const Capacity& capacity);
  const void* sent(std::string_view output, const MessageType& type);
  Latched& latched(std::string_view input);
  ChunkWriter& writer(std::string_view output);
  void before_start(std::string_view what) const;

  VirtualClock clock_{kEpochNs};
  Rate rate_{10, 1};
  std::filesystem::path read_ = ".", write_ = ".";
  uint64_t seed_ = 0, index_ = 0;
  int level_ = 0;
  bool started_ = false;
  int64_t deadline_ns_ = 0;
  std::string mode_ = "full";
  std::vector<const OutputPort*> unread_;
  std::vector<Chunk> handed_over_;
  std::vector<Latched> inputs_{node_->inputs().size()};
  std::vector<std::unique_ptr<ChunkWriter>> outputs_;  ///< none before start()
  std::optional<Job> job_;
  struct Log;
  std::unique_ptr<Log> log_;
  uint64_t allocations_ = 0;
  std::array<uint64_t, kJobCalls> calls_{};
};

}  // namespace takt::test

namespace takt {

/// One node under test: see the top of this file, and test::NodeRun for everything it can do. `NodeTest<Doubler>` makes
/// the node; `NodeTest test(type.make())` takes one that a NodeType made.
template <class T = Node>
class NodeTest : public test::NodeRun {
 public:
  NodeTest() : NodeRun(made()) {}
  explicit NodeTest(std::unique_ptr<T> node) : NodeRun(std::move(node)) {}
  T& node() { return static_cast<T&>(*node_); }

 private:
  static std::unique_ptr<T> made() {
    auto node = std::make_unique<T>();
    node->accept_requests();  // as NodeTypes::add does
    return node;
  }
};

}  // namespace takt
