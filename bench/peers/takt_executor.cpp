// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/takt_executor.hpp"

#include <algorithm>
#include <deque>

#include "bench/instants.hpp"
#include "bench/peers/medium.hpp"
#include "bench/peers/rung_graph.hpp"
#include "bench/suite.hpp"
#include "rt/msg/image.hpp"
#include "rt/node.hpp"

namespace takt::bench {
namespace {

constexpr Rate kRate{15, 1};
constexpr int64_t kBudgetNs = 100'000;   // a tenth of a millisecond per empty node: never the limit
constexpr size_t kMostFrames = 200'000;  // 3.7 hours

}  // namespace

/// Loans and sends one message per job and does nothing else; the sink notes when its job started.
class TaktExecutor::GraphNode final : public Node {
 public:
  GraphNode(const GraphShape& shape, size_t node, TaktExecutor& owner) : owner_(owner), sink_(node == shape.sink()) {
    if (shape.trigger(node)) trigger_.emplace_back(this, "trigger", "what releases this node");
    for (size_t i = 0; i < shape.sides(node).size(); ++i) sides_.emplace_back(this, "side", "taken along");
    if (!sink_) out_.emplace_back(this, "out", "a message of the asked size");
  }
  void setup(Setup&) override {}
  void start(int64_t epoch_ns) override {
    if (trigger_.empty()) owner_.epoch_ns_.store(epoch_ns);
  }
  void run(Job& job) override {
    if (sink_) return note(job.now_ns());
    if (out_[0].loan() != nullptr) out_[0].send(trigger_.empty() ? job.now_ns() : trigger_[0].stamp_ns());
  }

 private:
  void note(int64_t now) {
    const int64_t sent = trigger_[0].stamp_ns();
    const bool complete = std::all_of(sides_.begin(), sides_.end(),
                                      [&](const auto& side) { return !side.empty() && side.stamp_ns() == sent; });
    if (owner_.frames_.size() < kMostFrames) owner_.frames_.push_back({sent, now, complete});
  }

  TaktExecutor& owner_;
  const bool sink_;
  std::deque<Input<Image>> trigger_, sides_;  ///< deques, since ports cannot move
  std::deque<Output<Image>> out_;
};

TaktExecutor::TaktExecutor(const GraphShape& shape, uint32_t bytes, const Reservation& reservation) {
  frames_.reserve(kMostFrames);
  Plan plan;
  plan.policy = reservation.policy;
  plan.anticipate_ns = kDefaultAnticipate_ns;
  if (reservation.core >= 0) plan.cores = {reservation.core};
  for (size_t node = 0; node < shape.nodes; ++node) {
    nodes_.push_back(std::make_unique<GraphNode>(shape, node, *this));
    TaskPlan task;
    task.name = "node" + std::to_string(node);
    task.node = nodes_.back().get();
    task.deadline_ns = kRate.period_ns();
    task.budget_ns = kBudgetNs;
    if (const auto producer = shape.trigger(node)) {
      task.on_task = task.on_port = *producer;  // each node has one output: port and task share their number
      task.edges.push_back({0, *producer});
    } else {
      task.rate = kRate;
    }
    const std::vector<size_t> sides = shape.sides(node);
    for (size_t i = 0; i < sides.size(); ++i) task.edges.push_back({1 + i, sides[i]});
    if (node != shape.sink()) {
      task.ports = {plan.ports.size()};
      plan.ports.push_back(pool_plan(task.name, bytes, static_cast<uint32_t>(shape.leaving(node).size())));
    }
    plan.tasks.push_back(task);
  }
  transport_ = make_local_transport(plan.ports);
  executor_ = std::make_unique<Executor>(plan, *transport_, clock_, Executor::Options{});
}

TaktExecutor::~TaktExecutor() { stop(); }

int64_t TaktExecutor::start() {
  const std::vector<int> before = thread_ids();
  thread_ = std::thread([this] { result_ = executor_->run(); });
  for (int waited = 0; epoch_ns_.load() == 0; ++waited) {
    if (waited == 5000) throw CannotRun("Takt's executor did not start");
    sleep_until(now_ns() + 1'000'000);
  }
  sleep_until(epoch_ns_.load());  // all workers are there
  thread_ids_ = new_thread_ids(thread_ids(), before);
  return epoch_ns_.load();
}

void TaktExecutor::stop() {
  if (!thread_.joinable()) return;
  executor_->stop();
  thread_.join();
}

int64_t TaktExecutor::cpu_ns() const { return thread_cpu_ns(thread_ids_); }

std::vector<double> TaktExecutor::latencies_us(int64_t from_ns, int64_t to_ns) const {
  std::vector<double> latencies;
  for (const Frame& frame : frames_)
    if (frame.sent_ns >= from_ns && frame.sent_ns < to_ns)
      latencies.push_back(static_cast<double>(frame.arrived_ns - frame.sent_ns) * 1e-3);
  return latencies;
}

std::string TaktExecutor::granted() const {
  std::string text = granted_text(executor_->board().grant(0));
  for (const std::string& refused : result_.refused) text += "; " + refused;
  const auto incomplete =
      std::count_if(frames_.begin(), frames_.end(), [](const Frame& frame) { return !frame.complete; });
  if (incomplete > 0) text += ", " + std::to_string(incomplete) + " frames without a side message";
  return text;
}

}  // namespace takt::bench
