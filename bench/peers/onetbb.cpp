// SPDX-License-Identifier: Apache-2.0
// oneTBB's flow graph: a function_node per node, a join_node before the sink (it waits for all three messages; without
// it the sink ran ahead of the side branches in every frame). The thread that puts the frame in also helps to run it,
// as flow graph users write it (try_put, wait_for_all).
#include <tbb/flow_graph.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <deque>

#include "bench/futex.hpp"
#include "bench/instants.hpp"
#include "bench/peers/rung_graph.hpp"
#include "bench/suite.hpp"

namespace takt::bench {
namespace {

using Payload = std::shared_ptr<const std::vector<std::byte>>;

/// Handed on by pointer, as large as the others' messages; every node has one of its own.
struct Message {
  Payload payload;
  uint64_t frame = 0;
};

Payload make_payload(uint32_t bytes) { return std::make_shared<const std::vector<std::byte>>(bytes); }

/// Worker threads take the same policy as the thread that puts the frames in.
class SamePolicy final : public tbb::task_scheduler_observer {
 public:
  SamePolicy(tbb::task_arena& arena, const Reservation& reservation)
      : tbb::task_scheduler_observer(arena), reservation_(reservation) {
    observe(true);
  }
  ~SamePolicy() override { observe(false); }
  SamePolicy(const SamePolicy&) = delete;
  SamePolicy& operator=(const SamePolicy&) = delete;
  void on_scheduler_entry(bool worker) override {
    if (worker) apply(reservation_);
  }

 private:
  const Reservation reservation_;
};

class FlowGraph {
 public:
  FlowGraph(const GraphShape& shape, uint32_t bytes, GraphBoard& board) : board_(board), first_(make_payload(bytes)) {
    if (shape.sides(shape.sink()).size() != 2) throw CannotRun("the flow graph is written for a sink with two sides");
    for (size_t node = 1; node < shape.sink(); ++node)
      nodes_.emplace_back(graph_, tbb::flow::serial, [payload = make_payload(bytes)](const Message& in) {
        return Message{payload, in.frame};
      });
    size_t side = 0;
    for (const GraphEdge& edge : shape.edges) {
      if (edge.to != shape.sink()) connect(edge.from, nodes_[edge.to - 1]);
      else if (edge.trigger) connect(edge.from, tbb::flow::input_port<0>(join_));
      else if (side++ == 0) connect(edge.from, tbb::flow::input_port<1>(join_));
      else connect(edge.from, tbb::flow::input_port<2>(join_));
    }
    tbb::flow::make_edge(join_, sink_);
  }
  /// The source's job is the calling thread's.
  void run_frame() {
    board_.note_sent();
    source_.try_put({first_, ++frame_});
    graph_.wait_for_all();
  }

 private:
  using Joined = std::tuple<Message, Message, Message>;
  void connect(size_t from, tbb::flow::receiver<Message>& to) {
    if (from == 0) tbb::flow::make_edge(source_, to);
    else tbb::flow::make_edge(nodes_[from - 1], to);
  }
  void sink() {
    board_.arrived_ns.store(now_ns(), std::memory_order_relaxed);
    board_.note_arrived(0);
  }

  GraphBoard& board_;
  const Payload first_;
  tbb::flow::graph graph_;
  tbb::flow::broadcast_node<Message> source_{graph_};
  std::deque<tbb::flow::function_node<Message, Message>> nodes_;  ///< without source and sink
  tbb::flow::join_node<Joined, tbb::flow::queueing> join_{graph_};
  tbb::flow::function_node<Joined> sink_{graph_, tbb::flow::serial, [this](const Joined&) { sink(); }};
  uint64_t frame_ = 0;
};

void run(GraphBoard& board, const GraphShape& shape, uint32_t bytes, const Reservation& reservation) {
  tbb::task_arena arena;
  const SamePolicy observer(arena, reservation);
  arena.execute([&] {
    FlowGraph flow(shape, bytes, board);
    Bell bell(board.bell);
    board.ready.fetch_add(1);
    while (board.stop.load(std::memory_order_relaxed) == 0)
      if (bell.wait(kPatienceNs) && board.stop.load(std::memory_order_relaxed) == 0) flow.run_frame();
  });
}

}  // namespace

RungGraph::Runner onetbb_runner(const GraphShape& shape, uint32_t bytes, const Reservation& reservation) {
  return [=](GraphBoard& board) { run(board, shape, bytes, reservation); };
}

}  // namespace takt::bench
