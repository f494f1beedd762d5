// SPDX-License-Identifier: Apache-2.0
// Preemptive global earliest-deadline-first on m identical cores: sufficient tests for sporadic tasks with constrained
// deadlines. Nobody knows an exact test that is fast, so several are tried; they are incomparable, a set is schedulable
// if one of them says so. Pure functions; any thread.
//
// Of a TimedTask they use period, deadline, budget, jitter and blocking. Offsets are ignored: the answer holds for
// every phase, and for arrivals at any instants not closer than a period. Jitter shortens period and deadline, blocking
// lengthens the budget; both is sound and pessimistic.
#pragma once
#include <string_view>
#include <vector>

#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

/// Which test proved a set.
enum class GlobalTest : uint8_t {
  none,
  density,        ///< Goossens, Funk and Baruah 2003, with densities as in Bertogna, Cirinei and Lipari 2005
  interference,   ///< Bertogna, Cirinei and Lipari 2005 (BCL)
  response_time,  ///< Bertogna and Cirinei 2007, iterative, with slack
  carry_in,       ///< Baruah 2007 (BAR): at most m - 1 tasks carry work into the window
};
std::string_view to_string(GlobalTest test);

/// Sum of densities <= m - (m - 1) * largest density; density = budget / min(deadline, period). Exact where the least
/// common multiple of the deadlines fits, else rounded to the safe side.
bool density_test(const TaskSet& set);
/// BCL: for each task, what the others can run in its window with their deadlines in it leaves room.
bool interference_test(const TaskSet& set);
/// BAR. Gives up (false) beyond `max_points` lengths of the window of one task.
bool carry_in_test(const TaskSet& set, size_t max_points = 20'000);
/// Response bounds from the planned release; -1 where the iteration passes the deadline. They hold if either none is -1
/// or the set is known by another test to meet its deadlines.
std::vector<Ticks> global_response_times(const TaskSet& set);

/// Of a piece of work of task k by itself: from when it gets ready to its end, at most `budget` of work whose deadline
/// is no later than that of a job released at that instant, while the rest of task k does nothing. `responses` of all
/// tasks, from their planned releases, hold. -1 where the iteration passes the deadline.
Ticks global_response_of_part(const TaskSet& set, size_t k, Ticks budget, const std::vector<Ticks>& responses);

struct GlobalEdfResult {
  GlobalTest proven_by = GlobalTest::none;  ///< the first test that did
  /// By task, from the planned release: of the response-time test where that converged, else the deadline; -1 if
  /// nothing is proven.
  std::vector<Ticks> response = {};
  bool schedulable() const { return proven_by != GlobalTest::none; }
};
/// All tests in turn. A set with a budget above its deadline, or with more work than cores, is not schedulable.
/// Without `responses` the deadlines stand in for them, which is faster.
GlobalEdfResult global_edf(const TaskSet& set, bool responses = true);

}  // namespace takt::analysis
