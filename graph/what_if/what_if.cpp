// SPDX-License-Identifier: Apache-2.0
#include "graph/what_if/what_if.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "graph/what_if/stand_in.hpp"
#include "rt/sched/plan_ports.hpp"

namespace takt::what_if {
namespace {

/// A restarted process joins the release grid of its run, and so does a record that begins late.
class AtEpoch final : public StartGate {
 public:
  explicit AtEpoch(int64_t epoch_ns) : epoch_ns_(epoch_ns) {}
  bool all_granted(bool mine) override { return mine; }
  int64_t epoch_ns() override { return epoch_ns_; }

 private:
  const int64_t epoch_ns_;
};

class Simulation {
 public:
  Simulation(const Plan& plan, const RecordedRun& recorded, const PredictOptions& options, RunBoard& board)
      : plan_(plan), recorded_(recorded), options_(options), board_(board), clock_(recorded.from_ns) {
    prediction_.borrowed.resize(plan.tasks.size());
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      TaskPlan& task = plan_.tasks[t];
      stand_ins_.push_back(std::make_unique<StandIn>(plan.tasks[t], recorded.tasks[t]));
      task.node = stand_ins_.back().get();
      task.disturbance = nullptr;
      const double rate_hz = effective_rate_hz(plan, t);
      reach_ns_.push_back(rate_hz > 0 ? static_cast<int64_t>(0.5e9 / rate_hz) : 0);
    }
  }

  Prediction run() {
    const auto transport = make_local_transport(blank_ports());
    AtEpoch gate(recorded_.epoch_ns);
    Executor::Options run;
    run.duration_ns = std::max<int64_t>(1, recorded_.end_ns - recorded_.epoch_ns);  // 0: without an end
    run.board = &board_;
    run.gate = &gate;
    run.rejoin = recorded_.from_ns > recorded_.epoch_ns;
    run.job_duration_ns = [this](size_t task, uint64_t job) { return play(task, job); };
    prediction_.run = Executor(plan_, *transport, clock_, run).run();
    if (run.rejoin) leave_out_before();
    return std::move(prediction_);
  }

 private:
  /// The plan keeps the sizes of the real messages: what the runtime charges for them decides who gets which core.
  std::vector<PortPlan> blank_ports() const {
    std::vector<PortPlan> ports = plan_.ports;
    for (PortPlan& port : ports)
      if (const MessageType& type = stand_in_type(*port.type); &type != port.type) {
        port.type = &type;
        port.capacity = {};
        port.counts.reset();
      }
    return ports;
  }

  /// Before each job: which recorded one it plays. What it takes at full quality.
  int64_t play(size_t task, uint64_t job) {
    enter_modes();
    if (options_.stopped && options_.stopped()) board_.stop().raise(clock_.now_ns());
    const int64_t release_ns = recorded_release_ns(task, job);
    const PastJob* past = recorded_.tasks[task].nearest(release_ns);
    stand_ins_[task]->play(past);
    if (past == nullptr) return 0;
    prediction_.borrowed[task] += std::abs(past->release_ns - release_ns) > reach_ns_[task];
    return std::llround(static_cast<double>(past->full_ns) / options_.speed);
  }

  /// When the job would have been released in the record: a follower when the job that its producer plays was visible.
  int64_t recorded_release_ns(size_t t, uint64_t job) const {
    const TaskPlan& task = plan_.tasks[t];
    if (task.rate) return task.rate->release_ns(recorded_.epoch_ns + task.offset_ns, static_cast<int64_t>(job));
    const PastJob* producer = stand_ins_[task.on_task]->played();
    return producer != nullptr ? producer->visible_ns : clock_.now_ns();
  }

  /// As late as possible: a change that the schedule itself causes must not have to wait for those to come.
  void enter_modes() {
    for (; modes_ < recorded_.modes.size() && recorded_.modes[modes_].at_ns <= clock_.now_ns(); ++modes_) {
      const auto& change = std::get<record::ModeChange>(recorded_.modes[modes_].what);
      if (change.mode < plan_.modes.size())
        board_.modes().request(change.mode, recorded_.modes[modes_].at_ns, change.reason);
    }
  }

  /// The record says nothing of these releases.
  void leave_out_before() {
    prediction_.run.epoch_ns = recorded_.from_ns;
    for (size_t t = 0; t < plan_.tasks.size(); ++t) {
      const TaskPlan& task = plan_.tasks[t];
      if (!task.rate) continue;
      uint64_t& released = prediction_.run.released[t];
      const int64_t origin_ns = recorded_.epoch_ns + task.offset_ns;
      released -= std::min(released, static_cast<uint64_t>(task.rate->releases_before(origin_ns, recorded_.from_ns)));
    }
  }

  Plan plan_;
  const RecordedRun& recorded_;
  const PredictOptions& options_;
  RunBoard& board_;
  VirtualClock clock_;
  std::vector<std::unique_ptr<StandIn>> stand_ins_;
  std::vector<int64_t> reach_ns_;  ///< by task: half a period
  size_t modes_ = 0;               ///< of the record that are entered
  Prediction prediction_;
};

}  // namespace

Prediction predict(const Plan& plan, const RecordedRun& recorded, const PredictOptions& options, RunBoard& board) {
  return Simulation(plan, recorded, options, board).run();
}

}  // namespace takt::what_if
