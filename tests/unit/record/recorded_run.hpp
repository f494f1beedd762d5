// SPDX-License-Identifier: Apache-2.0
// A small graph on virtual time that is recorded: a device, a filter with a memory of its own, a reader of both.
#pragma once
#include <doctest/doctest.h>

#include <functional>
#include <vector>

#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/record/recorder.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/shm/transport.hpp"
#include "rt/trace/collector.hpp"
#include "tests/unit/rt/plans.hpp"

namespace takt::test {

struct OdometryDevice final : Node {
  Output<Odometry> odometry{this, "odometry", ""};
  void setup(Setup&) override {}
  void run(Job& job) override {
    Odometry* message = odometry.loan();
    if (message == nullptr || job.index() % 7 == 3) return;  // now and then it is silent
    message->x_m = 0.1 * static_cast<double>(job.index());
    odometry.send(job.release_ns() - 1000);
  }
};

/// What it makes depends on all that a job may observe.
struct Filter final : Node {
  Input<Odometry> odometry{this, "odometry", ""};
  Output<Grid> grid{this, "grid", ""};
  Param<double> gain{this, "gain", 2.0, "1", ""};
  Param<double> bias{this, "bias", 0.0, "1", ""};  ///< may be set while it runs
  double sum = 0;
  std::function<void(Job&)> meanwhile = {};  ///< what happens while a job is under way
  void setup(Setup&) override {
    grid.reserve({4, 2, 1, 0});
    gain();
  }
  void start(int64_t) override {
    if (const Grid* last = grid.handed_over()) sum = last->cell_m;
  }
  void run(Job& job) override {
    for (size_t i = 0; i < odometry.size(); ++i)
      if (odometry.is_new(i)) sum += gain() * odometry[i].x_m;
    Grid* message = grid.loan();
    if (message == nullptr) return;
    message->width = 4;
    message->height = 2;
    message->cell_m = sum + bias();
    message->grid_in_map.x = static_cast<double>(job.mode().size());
    if (meanwhile) meanwhile(job);
    message->origin_x_m = static_cast<double>(job.now_ns() % 1000);
    message->origin_y_m = static_cast<double>(job.time_left_ns());
    message->cells.resize(8);
    for (size_t i = 0; i < 8; ++i)
      message->cells[i] = static_cast<int16_t>(odometry.stale() ? -1 : static_cast<int>(job.index() + i));
    if (!odometry.empty()) grid.send(odometry.stamp_ns());
  }
};

struct GridReader final : Node {
  Input<Grid> grid{this, "grid", ""};
  Output<Odometry> seen{this, "seen", ""};
  void setup(Setup&) override {}
  void run(Job& job) override {
    Odometry* message = seen.loan();
    if (message == nullptr || grid.empty()) return;
    message->x_m = grid.newest()->cell_m;
    message->theta_rad = grid.newest()->cells[5];
    seen.send(job.release_ns());
  }
};

/// Fresh nodes with their plan.
struct SmallGraph {
  OdometryDevice device;
  Filter filter;
  GridReader reader;
  Plan plan;
  SmallGraph() {
    add_task(plan, device, "base", 0);
    add_task(plan, filter, "filter", 10'000'000, {4, 2, 1, 0});
    add_task(plan, reader, "reader", 55'000'000);
    for (size_t p = 0; p < plan.ports.size(); ++p) plan.ports[p].port = plan.tasks[p].node->outputs()[0]->name();
    plan.tasks[0].device = true;
    plan.tasks[0].rate = Rate{30, 1};
    plan.tasks[1].edges.push_back({0, 0, 4, 90'000'000});
    plan.tasks[2].edges.push_back({0, 1, 1, 0});
    for (PortPlan& port : plan.ports) {
      port.history = 16;
      port.held = 8;
      port.readers = 2;
    }
    const VirtualClock clock;
    Setup setup{clock, {}, {}, 1, std::nullopt, 0};
    for (Node* node : {static_cast<Node*>(&device), static_cast<Node*>(&filter), static_cast<Node*>(&reader)}) {
      node->setup(setup);
      node->end_setup();
    }
    for (const TaskPlan& task : plan.tasks)
      for (const EdgePlan& edge : task.edges)
        PortAccess::connect(*task.node->inputs()[edge.input], plan.ports[edge.port].capacity);
  }
};

/// By port: whether its messages are recorded with all fields, else by their hashes.
inline std::vector<record::PortRule> with_fields(const std::vector<char>& all) {
  std::vector<record::PortRule> rules(all.size());
  for (size_t p = 0; p < all.size(); ++p) rules[p].keep = all[p] != 0 ? record::PortRule::all : record::PortRule::hash;
  return rules;
}

/// A recorder, or what has some, hears what a collector takes in virtual time.
template <class Recorder>
trace::Collector::Options heard_by(Recorder& recorder) {
  trace::Collector::Options heard;
  heard.best = trace::Source::none;
  heard.by_caller = true;
  heard.listener = [&](int32_t ring, const trace::Event& event) { recorder.take(ring, event); };
  return heard;
}

/// Runs a plan for `seconds` of virtual time and records it into that place. Writers leave before the record ends; with
/// `copied_ns` nothing published later is copied.
template <class Place>  // mcap::Sink, record::Splits
record::RecordResult record_run(const Plan& plan, Place& place, int64_t seconds, record::Recorder::Options how = {},
                                const record::Head& head = {}, const std::function<void(RunBoard&)>& meanwhile = {},
                                int64_t copied_ns = INT64_MAX) {
  RunBoard board(plan);
  VirtualClock clock(1'000'000'000);
  const auto transport = make_local_transport(plan.ports);
  how.by_caller = true;
  record::Recorder recorder(plan, board, *transport, place, head, std::move(how));
  trace::Rings rings(4);
  trace::Collector collector(rings, heard_by(recorder));
  Executor::Options run;
  run.duration_ns = seconds * 1'000'000'000;
  run.board = &board;
  run.trace = &rings;
  run.after_step = [&] {
    collector.drain();
    if (clock.now_ns() < copied_ns) recorder.capture();
    if (meanwhile) meanwhile(board);
  };
  Executor(plan, *transport, clock, run).run();
  collector.finish();
  return recorder.finish({{"epoch_ns", "1000000000"}});
}

}  // namespace takt::test
