// SPDX-License-Identifier: Apache-2.0
// When members of lanes are done, by the pieces that the lanes consist of.
#pragma once
#include "graph/check/admission.hpp"
#include "graph/check/lane_pieces.hpp"
#include "graph/check/policy_analysis.hpp"

namespace takt::graph {

/// The larger bounds of both; there is none where one has none.
NodeAdmission longer(const NodeAdmission& a, const NodeAdmission& b);

class PieceBounds {
 public:
  /// `whole`: what analyse_set, with responses, said of `pieces.set`; it admitted it.
  PieceBounds(const Plan& plan, const analysis::Overheads& overheads, const LaneTasks& lanes, const PieceSet& pieces,
              SetAnswer whole);
  /// By task of the plan, whichever pass it is in; nothing where no bound is found. `starts`: those that check_ages
  /// asks for, too.
  std::vector<NodeAdmission> longest(bool starts) const;

 private:
  struct Place {
    size_t piece = 0, at = 0;  ///< index of a piece, and into its members
  };
  size_t task_at(const Place& place) const;
  int64_t ns(analysis::Ticks ticks) const;
  analysis::Ticks ticks(int64_t ns) const { return ns * pieces_.set.ticks_per_ns; }
  std::optional<int64_t> bound_of(const Part& part) const;
  Part alone(size_t piece, int64_t work_ns) const;
  std::optional<int64_t> finish_of(const Place& place) const;
  int64_t finish_in_turn(const Place& place) const;
  std::optional<int64_t> continuation_of(const Place& before, const Place& place) const;
  std::optional<Place> prompt_one_before(const Place& place) const;
  std::optional<int64_t> response_when_woken(const Place& place) const;
  std::optional<int64_t> response_of(const Place& place) const;
  std::optional<int64_t> start_of(const Place& place) const;

  const Plan& plan_;
  const analysis::Overheads& overheads_;
  const LaneTasks& lanes_;
  const PieceSet& pieces_;
  const SetAnswer whole_;
  bool waits_ = false;  ///< within some piece
};

}  // namespace takt::graph
