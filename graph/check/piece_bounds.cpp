// SPDX-License-Identifier: Apache-2.0
#include "graph/check/piece_bounds.hpp"

#include <algorithm>
#include <span>

#include "rt/sched/lane.hpp"

namespace takt::graph {
namespace {

/// The larger bound; there is none where one of them is missing.
std::optional<int64_t> longer_of(const std::optional<int64_t>& a, const std::optional<int64_t>& b) {
  return a && b ? std::optional(std::max(*a, *b)) : std::nullopt;
}

}  // namespace

NodeAdmission longer(const NodeAdmission& a, const NodeAdmission& b) {
  return {longer_of(a.response_ns, b.response_ns), longer_of(a.start_ns, b.start_ns),
          longer_of(a.finish_ns, b.finish_ns)};
}

PieceBounds::PieceBounds(const Plan& plan, const analysis::Overheads& overheads, const LaneTasks& lanes,
                         const PieceSet& pieces, SetAnswer whole)
    : plan_(plan), overheads_(overheads), lanes_(lanes), pieces_(pieces), whole_(std::move(whole)) {
  waits_ = std::any_of(pieces.pieces.begin(), pieces.pieces.end(), [](const Piece& piece) { return piece.waits; });
}

size_t PieceBounds::task_at(const Place& place) const {
  const Piece& piece = pieces_.pieces[place.piece];
  return lanes_.lanes[piece.lane][piece.members[place.at]];
}

int64_t PieceBounds::ns(analysis::Ticks ticks) const {
  return (ticks + pieces_.set.ticks_per_ns - 1) / pieces_.set.ticks_per_ns;
}

std::optional<int64_t> PieceBounds::bound_of(const Part& part) const {
  const auto found = response_of_part(pieces_.set, plan_.policy, whole_, part);
  return found ? std::optional(ns(*found)) : std::nullopt;
}

/// A part that the thread may begin with in the instant in which it is ready, the piece before being done.
Part PieceBounds::alone(size_t piece, int64_t work_ns) const {
  Part part{piece, ticks(work_ns)};
  for (size_t p = 0; p < pieces_.pieces.size(); ++p)
    if (p != piece && pieces_.pieces[p].lane == pieces_.pieces[piece].lane) part.same_thread.push_back(p);
  return part;
}

/// From the planned release of the lane's head, as all instants here.
std::optional<int64_t> PieceBounds::finish_of(const Place& place) const {
  const Piece& piece = pieces_.pieces[place.piece];
  const auto response = place.at + 1 == piece.members.size()
                            ? std::optional(ns(*whole_.response[place.piece]))
                            : bound_of({place.piece, ticks(work_until_ns(plan_, lanes_, piece, place.at, overheads_))});
  if (!response) return std::nullopt;
  if (plan_.policy == Policy::cooperative && place.at > 0) return std::min(*response, finish_in_turn(place));
  return piece.ready_ns + piece.woken_ns + *response;
}

/// Nobody comes between the members of a piece: each begins when the one before is done, and what it follows is seen.
int64_t PieceBounds::finish_in_turn(const Place& place) const {
  const size_t lane = pieces_.pieces[place.piece].lane;
  std::vector<int64_t> done(place.at + 1), seen(place.at + 1);
  for (size_t k = 0; k <= place.at; ++k) {
    const size_t task = task_at({place.piece, k});
    int64_t released = 0;
    for (size_t p = 0; p < k; ++p)
      if (task_at({place.piece, p}) == plan_.tasks[task].on_task) released = seen[p];
    const size_t member = pieces_.pieces[place.piece].members[k];
    done[k] = k == 0 ? *finish_of({place.piece, 0})
                     : std::max(done[k - 1], released) +
                           occupied_ns(plan_, lanes_.lanes[lane], std::span(&member, 1), overheads_);
    const bool let = plan_.tasks[task].publish == PublishAt::let;
    seen[k] = let ? std::max(done[k], released + plan_.tasks[task].deadline_ns) : done[k];
  }
  return done.back();
}

/// Of a member that its thread comes to at some time after it has published `before`, from then.
std::optional<int64_t> PieceBounds::continuation_of(const Place& before, const Place& place) const {
  const Piece& piece = pieces_.pieces[place.piece];
  const auto between = std::span(piece.members).subspan(before.at + 1, place.at - before.at);
  Part part = alone(place.piece, occupied_ns(plan_, lanes_.lanes[piece.lane], between, overheads_));
  part.first = false;
  if (const auto ready = finish_of(before), done = finish_of(place); ready && done && !waits_) {
    const int64_t begins_ns = piece.ready_ns + piece.woken_ns;
    part.ready_by = ticks(*ready - begins_ns);
    part.done_by = ticks(*done - begins_ns);
    part.slack = ticks(plan_.anticipate_ns + overheads_.release_ns);
  }
  return bound_of(part);
}

/// The last member before this one, of those that it follows, whose output is seen at once.
std::optional<PieceBounds::Place> PieceBounds::prompt_one_before(const Place& place) const {
  size_t producer = plan_.tasks[task_at(place)].on_task;
  for (Place before = place; before.at > 0 && producer != kNone;) {
    if (task_at({before.piece, --before.at}) != producer) continue;
    if (plan_.tasks[producer].publish == PublishAt::asap) return before;
    producer = plan_.tasks[producer].on_task;
  }
  return std::nullopt;
}

/// Of what begins a piece whose instant is not known in advance, from that instant: as if it were one of some short
/// stretches of time, whichever is the worst.
std::optional<int64_t> PieceBounds::response_when_woken(const Place& place) const {
  constexpr int kStretches = 16;
  const Piece& piece = pieces_.pieces[place.piece];
  const Part part = alone(place.piece, work_until_ns(plan_, lanes_, piece, place.at, overheads_));
  analysis::TaskSet set = pieces_.set;
  analysis::TimedTask& task = set.tasks[place.piece];
  task.jitter = (task.jitter + kStretches - 1) / kStretches;
  int64_t longest = 0;
  for (int k = 0; k < kStretches; ++k, task.offset += task.jitter) {
    const auto found = response_of_part(set, plan_.policy, whole_, part);
    if (!found) return std::nullopt;
    longest = std::max(longest, ns(*found));
  }
  return longest;
}

/// From its own release.
std::optional<int64_t> PieceBounds::response_of(const Place& place) const {
  const Piece& piece = pieces_.pieces[place.piece];
  const size_t task = task_at(place), producer = plan_.tasks[task].on_task;
  std::optional<int64_t> bound = finish_of(place);
  if (producer == kNone) return bound;
  if (bound) *bound -= released_after_ns(plan_, task);
  std::optional<int64_t> other;
  // A worker that waits for an output to become visible lets others run, who may then be in its way.
  if (!piece.waits || plan_.policy == Policy::cooperative) {
    if (const auto before = prompt_one_before(place); before && (other = continuation_of(*before, place)))
      *other -= released_after_ns(plan_, task) - released_after_ns(plan_, task_at(*before));
  }
  const bool begins = place.at == 0 && piece.prompt && piece.ready_by_ns > piece.ready_ns;
  if (begins) other = response_when_woken(place);
  return !bound || (other && *other < *bound) ? other : bound;
}

/// Of what a pass begins with: as if it had only to begin. Others begin when the member before is done; what is waited
/// for, before it ends itself.
std::optional<int64_t> PieceBounds::start_of(const Place& place) const {
  const size_t producer = plan_.tasks[task_at(place)].on_task;
  if (producer != kNone)
    return finish_of(place.at > 0 && plan_.tasks[producer].publish == PublishAt::asap ? Place{place.piece, place.at - 1}
                                                                                      : place);
  const Piece& piece = pieces_.pieces[place.piece];
  constexpr int64_t kMicrosecond = 1'000;
  const int64_t lead = plan_.policy == Policy::cooperative ? 0 : longest_lead_ns(plan_, lanes_.lanes[piece.lane]);
  return bound_of({place.piece, ticks(lead + overheads_.release_ns + overheads_.switch_ns + kMicrosecond)});
}

std::vector<NodeAdmission> PieceBounds::longest(bool starts) const {
  std::vector<NodeAdmission> nodes(plan_.tasks.size());
  std::vector<bool> known(nodes.size(), false);
  for (size_t p = 0; p < pieces_.pieces.size(); ++p) {
    for (size_t at = 0; at < pieces_.pieces[p].members.size(); ++at) {
      const Place place{p, at};
      const size_t task = task_at(place);
      const auto& edges = plan_.tasks[task].edges;
      const bool aged = std::any_of(edges.begin(), edges.end(), [](const auto& edge) { return edge.max_age_ns > 0; });
      const NodeAdmission here{response_of(place), starts && aged ? start_of(place) : std::nullopt, finish_of(place)};
      nodes[task] = known[task] ? longer(nodes[task], here) : here;
      known[task] = true;
    }
  }
  return nodes;
}

}  // namespace takt::graph
