// SPDX-License-Identifier: Apache-2.0
#include "graph/check/lane_pieces.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>

#include "rt/sched/lane.hpp"

namespace takt::graph {
namespace {

using Members = std::vector<size_t>;

/// Bound on the release of a task, from the planned one of its head.
int64_t released_by_ns(const Plan& plan, size_t task, const std::vector<int64_t>& done_by_ns) {
  const size_t producer = plan.tasks[task].on_task;
  if (producer == kNone) return 0;
  if (!waits_for_release(plan, task)) return done_by_ns[producer];
  return released_by_ns(plan, producer, done_by_ns) + plan.tasks[producer].deadline_ns;
}

/// A pass with these members, cut where the worker may have to wait.
std::vector<Piece> cut(const Plan& plan, size_t lane, const Members& tasks, const Members& members, bool at_waits,
                       const std::vector<int64_t>& done_by_ns) {
  std::vector<Piece> pieces;
  for (const size_t m : members) {
    const bool waited = waits_for_release(plan, tasks[m]);
    if (pieces.empty()) {
      pieces.push_back({lane, {}});
    } else if (waited && !at_waits) {
      pieces.back().waits = true;
    }
    if (waited && at_waits) {
      const Piece& before = pieces.back();
      const int64_t from = released_after_ns(plan, tasks[m]), by = released_by_ns(plan, tasks[m], done_by_ns);
      // Nothing to wait for if that is visible before whatever was waited for last.
      if (by > before.ready_ns)
        pieces.push_back(
            {lane, {}, std::max(from, before.ready_ns), std::max(by, before.ready_by_ns), from >= before.ready_by_ns});
    }
    pieces.back().members.push_back(m);
  }
  return pieces;
}

/// A member with `every`, and who goes with it because it follows all of its messages.
struct Seldom {
  size_t lane = 0;
  size_t after = kNone;  ///< the entry whose runs it counts; none: every pass
  int64_t every = 1;     ///< of those
  int64_t passes = 1;    ///< from one run to the next
  Members members = {};
};

std::vector<Seldom> seldom_members(const Plan& plan, const LaneTasks& lanes) {
  std::vector<Seldom> all;
  for (size_t l = 0; l < lanes.lanes.size(); ++l) {
    const Members& tasks = lanes.lanes[l];
    std::vector<size_t> entry(tasks.size(), kNone);
    for (size_t m = 1; m < tasks.size(); ++m) {
      const TaskPlan& task = plan.tasks[tasks[m]];
      entry[m] = entry[static_cast<size_t>(std::find(tasks.begin(), tasks.end(), task.on_task) - tasks.begin())];
      if (task.every > 1) {
        const int64_t before = entry[m] == kNone ? 1 : all[entry[m]].passes;
        const auto every = std::min<int64_t>(task.every, kMostPasses + 1);
        all.push_back({l, entry[m], every, std::min(before * every, kMostPasses + 1)});
        entry[m] = all.size() - 1;
      }
      if (entry[m] != kNone) all[entry[m]].members.push_back(m);
    }
  }
  return all;
}

/// Passes of each lane until its members repeat.
std::vector<int64_t> passes_until_repeated(const std::vector<Seldom>& seldom, size_t lanes) {
  std::vector<int64_t> passes(lanes, 1);
  for (const Seldom& each : seldom)
    if (passes[each.lane] <= kMostPasses) passes[each.lane] = std::lcm(passes[each.lane], each.passes);
  return passes;
}

bool few_enough(const std::vector<Seldom>& seldom, size_t lanes) {
  int64_t ways = 1;
  for (const Seldom& each : seldom)
    if ((ways *= each.every) > kMostWays) return false;
  const std::vector<int64_t> passes = passes_until_repeated(seldom, lanes);
  return std::all_of(passes.begin(), passes.end(), [](int64_t count) { return count <= kMostPasses; });
}

/// More of them for lanes with followers, until all lanes repeat, where these are not too many.
std::vector<int64_t> until_all_repeat(const LaneTasks& lanes, std::vector<int64_t> passes) {
  const std::vector<int64_t> fewer = passes;
  const std::optional<analysis::Ticks> common = lanes.set.hyperperiod();
  int64_t all = 0;
  for (size_t l = 0; l < passes.size() && common; ++l) {
    const int64_t count = *common / lanes.set.tasks[l].period;
    if (count > kMostPasses) return fewer;
    if (lanes.lanes[l].size() > 1) passes[l] = std::lcm(passes[l], count);
    if ((all += passes[l]) > kMostPasses) return fewer;
  }
  return passes;
}

class Builder {
 public:
  Builder(const Plan& plan, const LaneTasks& lanes, const analysis::Overheads& overheads,
          const std::vector<int64_t>& done_by_ns, bool at_waits, std::vector<int64_t> passes)
      : plan_(plan),
        lanes_(lanes),
        overheads_(overheads),
        done_by_ns_(done_by_ns),
        at_waits_(at_waits),
        passes_(std::move(passes)) {}

  /// `phases`: by entry of `seldom`, the first run it is in of those that it counts.
  PieceSet way(const std::vector<Seldom>& seldom, const std::vector<int64_t>& phases) const {
    PieceSet result;
    result.set.ticks_per_ns = lanes_.set.ticks_per_ns;
    result.set.cores = lanes_.set.cores;
    for (size_t l = 0; l < lanes_.lanes.size(); ++l) {
      if (lanes_.set.tasks[l].sporadic) add_sporadic(l, result);
      else
        for (int64_t pass = 0; pass < passes_[l]; ++pass) add(l, pass, members_of(l, pass, seldom, phases), result);
    }
    const auto others = lanes_.set.tasks.begin() + static_cast<ptrdiff_t>(lanes_.lanes.size());
    result.set.tasks.insert(result.set.tasks.end(), others, lanes_.set.tasks.end());
    return result;
  }

 private:
  Members members_of(size_t l, int64_t pass, const std::vector<Seldom>& seldom,
                     const std::vector<int64_t>& phases) const {
    std::vector<bool> in(lanes_.lanes[l].size(), true);
    std::vector<int64_t> first(seldom.size(), 0);  // pass
    for (size_t s = 0; s < seldom.size(); ++s) {
      const Seldom& each = seldom[s];
      first[s] = each.after == kNone ? phases[s] : first[each.after] + phases[s] * seldom[each.after].passes;
      if (each.lane == l && pass % each.passes != first[s])
        for (const size_t m : each.members) in[m] = false;
    }
    Members members;
    for (size_t m = 0; m < in.size(); ++m)
      if (in[m]) members.push_back(m);
    return members;
  }

  /// All members in every pass, and passes at any time.
  void add_sporadic(size_t l, PieceSet& result) const {
    Piece piece{l, Members(lanes_.lanes[l].size())};
    std::iota(piece.members.begin(), piece.members.end(), size_t{0});
    piece.woken_ns = lane_wait_ns(plan_, lanes_.lanes[l]);
    result.set.tasks.push_back(lanes_.set.tasks[l]);
    result.pieces.push_back(std::move(piece));
  }

  void add(size_t l, int64_t pass, const Members& members, PieceSet& result) const {
    const analysis::TimedTask& whole = lanes_.set.tasks[l];
    const analysis::Ticks ticks = lanes_.set.ticks_per_ns;
    for (Piece& piece : cut(plan_, l, lanes_.lanes[l], members, at_waits_, done_by_ns_)) {
      analysis::TimedTask task = whole;
      if (piece.ready_ns > 0) task.name = plan_.tasks[lanes_.lanes[l][piece.members.front()]].name;
      task.period = whole.period * passes_[l];
      task.offset = whole.offset + whole.period * pass + piece.ready_ns * ticks;
      task.deadline = whole.deadline - piece.ready_ns * ticks;
      task.jitter = (piece.ready_by_ns - piece.ready_ns) * ticks + (piece.ready_ns == 0 ? whole.jitter : 0);
      task.budget = work_until_ns(plan_, lanes_, piece, piece.members.size() - 1, overheads_) * ticks;
      result.set.tasks.push_back(std::move(task));
      result.pieces.push_back(std::move(piece));
    }
  }

  const Plan& plan_;
  const LaneTasks& lanes_;
  const analysis::Overheads& overheads_;
  const std::vector<int64_t>& done_by_ns_;
  const bool at_waits_;
  const std::vector<int64_t> passes_;  ///< of each lane that are told apart
};

}  // namespace

std::vector<PieceSet> lane_pieces(const Plan& plan, const LaneTasks& lanes, const analysis::Overheads& overheads,
                                  const std::vector<int64_t>& done_by_ns, Splitting splitting) {
  std::vector<Seldom> seldom;
  if (splitting.by_pass) seldom = seldom_members(plan, lanes);
  if (!few_enough(seldom, lanes.lanes.size())) seldom.clear();
  std::vector<int64_t> passes = passes_until_repeated(seldom, lanes.lanes.size());
  if (splitting.by_pass) passes = until_all_repeat(lanes, std::move(passes));
  const Builder builder(plan, lanes, overheads, done_by_ns, splitting.at_waits, std::move(passes));
  std::vector<PieceSet> ways;
  std::vector<int64_t> phases(seldom.size(), 0);
  while (true) {
    ways.push_back(builder.way(seldom, phases));
    size_t s = 0;  // the next combination, as a counter goes on
    while (s < seldom.size() && ++phases[s] == seldom[s].every) phases[s++] = 0;
    if (s == seldom.size()) return ways;
  }
}

int64_t work_until_ns(const Plan& plan, const LaneTasks& lanes, const Piece& piece, size_t place,
                      const analysis::Overheads& overheads) {
  const Members& lane = lanes.lanes[piece.lane];
  const bool leads = piece.ready_ns == 0 && plan.policy != Policy::cooperative;
  const bool sleeps = piece.ready_ns == 0 && lane_wait_ns(plan, lane) > 0;
  return (leads ? longest_lead_ns(plan, lane) : 0) + (sleeps ? 2 : 1) * begin_ns(overheads) + lanes.looks_ns[piece.lane] +
         occupied_ns(plan, lane, std::span(piece.members).first(place + 1), overheads);
}

bool waits_for_release(const Plan& plan, size_t task) {
  const size_t producer = plan.tasks[task].on_task;
  return producer != kNone && plan.tasks[producer].publish == PublishAt::let;
}

int64_t released_after_ns(const Plan& plan, size_t task) {
  const size_t producer = plan.tasks[task].on_task;
  if (producer == kNone) return 0;
  return released_after_ns(plan, producer) + (waits_for_release(plan, task) ? plan.tasks[producer].deadline_ns : 0);
}

}  // namespace takt::graph
