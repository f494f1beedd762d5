// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/latch.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "rt/hot.hpp"
#include "rt/sched/port_access.hpp"

namespace takt {

namespace {
using Candidates = std::array<Candidate, InputPort::kMaxDepth>;
}

Latch::Latch(const TaskPlan& plan, Transport& transport, RunBoard& board, size_t task, const Clock& clock)
    : excesses_(board.excesses()), faults_(board.faults()), task_(static_cast<uint32_t>(task)), name_(plan.name) {
  for (const EdgePlan& edge : plan.edges) {
    Edge& e = edges_.emplace_back();
    e.plan = edge;
    e.input = plan.node->inputs()[edge.input];
    e.reader = transport.make_reader(edge.port);
    if (CommitRing* commits = board.commits_of_port(edge.port)) e.reader->set_commits(*commits, clock);
    e.requests = e.input == plan.node->control();
    e.statistics = &board.edge(task, edges_.size() - 1);
    e.last_seen = e.statistics->last_seen;
    e.pass_over_from = e.statistics->pass_over_from.load();
    e.pass_over_to = e.statistics->pass_over_to.load();
  }
  for (const auto& group : plan.joins) {
    std::vector<size_t> members;
    for (const size_t input : group) {
      for (size_t i = 0; i < edges_.size(); ++i) {
        if (edges_[i].plan.input != input) continue;
        edges_[i].joined = true;
        members.push_back(i);
      }
    }
    if (!members.empty()) joins_.push_back(std::move(members));
  }
}

TAKT_HOT void Latch::acquire_requests(int64_t release_ns, int64_t now_ns) {
  for (Edge& edge : edges_) {
    if (edge.requests) acquire_newest(edge, release_ns, now_ns);
  }
}

TAKT_HOT size_t Latch::acquire(int64_t release_ns, int64_t now_ns) {
  stale_count_ = 0;
  for (Edge& edge : edges_) {
    if (!edge.joined && !edge.requests) acquire_newest(edge, release_ns, now_ns);
  }
  for (const auto& group : joins_) acquire_join(group, release_ns, now_ns);
  return stale_count_;
}

void Latch::acquire_newest(Edge& edge, int64_t release_ns, int64_t now_ns) {
  Candidates candidates;
  const size_t depth = std::min<size_t>(edge.plan.depth, candidates.size());
  size_t listed = edge.reader->list(release_ns, std::span(candidates.data(), depth));
  auto& held = PortAccess::held(*edge.input);
  size_t count = 0;
  for (size_t i = listed; i-- > 0;) {  // candidates are newest first, inputs oldest first
    if (edge.passes_over(candidates[i].sequence)) continue;
    Held message = edge.reader->take(candidates[i].sequence);
    if (message) held[count++] = message;
  }
  const bool old = count > 0 && edge.plan.max_age_ns > 0 && now_ns - held[count - 1].stamp_ns > edge.plan.max_age_ns;
  account(edge, count, count == 0 || old, now_ns);
}

void Latch::acquire_join(const std::vector<size_t>& group, int64_t release_ns, int64_t now_ns) {
  Candidates first;
  const size_t listed = edges_[group.front()].reader->list(release_ns, first);
  for (size_t i = 0; i < listed; ++i) {
    if (take_set(group, first[i].stamp_ns, release_ns, now_ns)) return;
  }
  for (const size_t index : group) account(edges_[index], 0, true, now_ns);
}

bool Latch::take_set(const std::vector<size_t>& group, int64_t stamp_ns, int64_t release_ns, int64_t now_ns) {
  size_t taken = 0;
  bool old = false;
  for (const size_t index : group) {
    Edge& edge = edges_[index];
    Candidates candidates;
    const size_t listed = edge.reader->list(release_ns, candidates);
    const auto* match = std::find_if(candidates.data(), candidates.data() + listed,
                                     [&](const Candidate& c) { return c.stamp_ns == stamp_ns; });
    if (match == candidates.data() + listed || edge.passes_over(match->sequence)) break;
    Held message = edge.reader->take(match->sequence);
    if (!message) break;
    PortAccess::held(*edge.input)[0] = message;
    old = old || (edge.plan.max_age_ns > 0 && now_ns - stamp_ns > edge.plan.max_age_ns);
    ++taken;
  }
  if (taken < group.size()) {
    for (size_t i = 0; i < taken; ++i) {
      Edge& edge = edges_[group[i]];
      edge.reader->release(PortAccess::held(*edge.input)[0]);
    }
    return false;
  }
  for (const size_t index : group) account(edges_[index], 1, old, now_ns);
  return true;
}

void Latch::account(Edge& edge, size_t count, bool stale, int64_t now_ns) {
  PortAccess::set_held(*edge.input, count, stale, edge.last_seen);
  if (stale) {
    ++edge.fresh.stale;
    ++stale_count_;
  }
  if (count == 0) return;
  const auto& held = PortAccess::held(*edge.input);
  edge.age_ns = now_ns - held[count - 1].stamp_ns;
  edge.latched_ns = now_ns;
  edge.statistics->in_hand.store(held[count - 1].sequence, std::memory_order_relaxed);
  for (size_t i = 0; i < count; ++i) {
    if (held[i].sequence <= edge.last_seen) continue;
    edge.fresh.dropped += held[i].sequence - edge.last_seen - 1;
    ++edge.fresh.received;
    edge.last_seen = held[i].sequence;
  }
}

void Latch::release() {
  for (Edge& edge : edges_) {
    auto& held = PortAccess::held(*edge.input);
    for (size_t i = 0; i < PortAccess::held_count(*edge.input); ++i) edge.reader->release(held[i]);
    PortAccess::set_held(*edge.input, 0, true, edge.last_seen);
  }
}

void Latch::count() {
  for (size_t e = 0; e < edges_.size(); ++e) {
    Edge& edge = edges_[e];
    edge.statistics->received += edge.fresh.received;
    edge.statistics->dropped += edge.fresh.dropped;
    add(edge.statistics->stale, edge.fresh.stale);
    edge.statistics->last_seen = edge.last_seen;
    edge.fresh = {};
    if (edge.reader->damaged() != edge.damaged) tell_damage(edge);
    if (edge.age_ns == kNoAge) continue;
    edge.statistics->age.add(edge.age_ns);
    edge.statistics->age_bound.compare(
        {Excess::input_age, task_, static_cast<uint32_t>(e), edge.latched_ns, edge.age_ns}, excesses_);
    edge.age_ns = kNoAge;
  }
}

void Latch::tell_damage(Edge& edge) {
  const bool first = edge.statistics->damaged == 0;
  edge.statistics->damaged += edge.reader->damaged() - std::exchange(edge.damaged, edge.reader->damaged());
  if (!first) return;  // the report has how many
  Fault fault;
  fault.kind = Fault::damaged;
  fault.task = task_;
  fault.at_ns = edge.latched_ns;
  const std::string_view input = edge.input->name();
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(),
                "%s.%.*s: a message is lost: the process of its producer has written over it", name_.c_str(),
                static_cast<int>(input.size()), input.data());
  faults_.append(fault);
}

TAKT_HOT void Latch::rehearse(int64_t release_ns) const {
  for (const Edge& edge : edges_) {
    prefetch(edge.input, sizeof(InputPort));
    prefetch(edge.statistics, sizeof *edge.statistics);
    Candidate newest;
    edge.reader->list(release_ns, std::span(&newest, 1));
  }
}

}  // namespace takt
