// SPDX-License-Identifier: Apache-2.0
// Lanes as the tasks that say most about them: what a worker does between two waits is a task of its own, and a pass
// that a member leaves out (`every`) is another task than one that it is in.
#pragma once
#include <vector>

#include "rt/sched/lane_tasks.hpp"

namespace takt::graph {

/// What a pass of a lane does at one go.
struct Piece {
  size_t lane = 0;
  std::vector<size_t> members;  ///< positions in the lane, in the order of running
  /// Bounds on the instant at which the worker may begin with it, from the planned release of the lane's head; 0 for
  /// what a pass begins with.
  int64_t ready_ns = 0, ready_by_ns = 0;
  /// That instant is the release of its first member: what the pass did before is ready earlier in any case.
  bool prompt = true;
  bool waits = false;  ///< the worker waits within it, too, for an output to become visible
  /// So long after that instant its work may come, which the response of its task does not count: it is sporadic.
  int64_t woken_ns = 0;
};

/// One way in which the members that are not in every pass may fall.
struct PieceSet {
  analysis::TaskSet set;      ///< a task for each piece; behind them what is nobody's (ordinary threads)
  std::vector<Piece> pieces;  ///< in the order of the set
};

struct Splitting {
  bool at_waits = false;  ///< a wait (`publish: let` before a follower) is no work; the worker is free meanwhile
  /// A member with `every` is in every so-many-th pass, in any of them first. Passes of lanes with followers are told
  /// apart until all lanes repeat, too: what a follower meets depends on it.
  bool by_pass = false;
};

/// All ways, or the lanes as they are where nothing is split. `done_by_ns`: bounds on the publication of each task from
/// the release of its lane's head; outputs that are waited for keep their deadlines. With `by_pass`, more than
/// kMostWays ways, or kMostPasses passes of a lane until its members repeat, are not told apart: members count as in
/// every pass then. Nor are passes until all lanes repeat, if these are more than kMostPasses of all lanes.
///
/// Why these ways are enough: what follows every k-th message runs in one of k passes at most, more rarely where its
/// producer makes none. From any pass on (and, looking back, up to any), let each member run as soon as that allows:
/// its n-th run comes no later than it did, so that at every instant at least as much work has come. Followers of such
/// members are still in step with them: of what is k2 of their runs apart, nothing is less than k1 * k2 passes apart.
std::vector<PieceSet> lane_pieces(const Plan& plan, const LaneTasks& lanes, const analysis::Overheads& overheads,
                                  const std::vector<int64_t>& done_by_ns, Splitting splitting);

inline constexpr int64_t kMostWays = 64, kMostPasses = 100;

/// Longest work of a piece up to its member at that place (an index into Piece::members), overheads of its beginning
/// and, under policies with workers of their own, of being awake early included.
int64_t work_until_ns(const Plan& plan, const LaneTasks& lanes, const Piece& piece, size_t place,
                      const analysis::Overheads& overheads);

/// Whether a task is released at an instant that its worker may have to wait for: it follows a `let` output.
bool waits_for_release(const Plan& plan, size_t task);

/// The least time from the planned release of a task's head to its own release.
int64_t released_after_ns(const Plan& plan, size_t task);

}  // namespace takt::graph
