// SPDX-License-Identifier: Apache-2.0
// The plan that costs least: A* over the values of the state variables and the place of the robot (C-6).
#pragma once
#include "nodes/navigation/indexed_heap.hpp"
#include "nodes/planner/plan.hpp"
#include "rt/state_archive.hpp"

namespace takt::planner {

struct SearchCapacity {
  size_t states = 200'000;
  size_t changes = 1'600'000;  ///< by which all of them together differ from the beginning
  size_t actions = 200'000;    ///< of the domains that it will be given
};

/// Memory is taken by the constructor; a search takes none but the plan's. One thread at a time.
class Search {
 public:
  explicit Search(const SearchCapacity& capacity);

  /// `known` is a plan of the same domain, or none: what cannot cost less is not looked at, and `known` is what is
  /// returned if nothing does. Ends early at the effort's end or where memory is used up, with the bound reached; at
  /// once for a domain of too many actions.
  Plan find(const Domain& domain, const Effort& effort, const Plan& known) {
    begin(domain, known);
    go_on(effort);
    return plan_;
  }

  /// The same in portions: what one leaves, the next goes on with; the same plan in the end. The domain stays until
  /// then.
  void begin(const Domain& domain, const Plan& known);
  /// One portion; true once the search is over. More expansions than a portion's effort it does not make.
  bool go_on(const Effort& effort);
  /// The best so far and what is proved.
  const Plan& plan() const { return plan_; }
  /// A search under way in `domain`, or the plan of one that is over.
  void remember(StateArchive& archive, const Domain& domain);

 private:
  /// Differs from the beginning in `count` variables from `first` on, ascending.
  struct State {
    int64_t cost_ns;
    uint64_t hash;
    uint32_t from, action, place, first, count;
  };
  using Key = std::pair<int64_t, int64_t>;  ///< cost with what is left at least; then the dearer first
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  void prepare();
  void find_worthwhile();
  int64_t way_ns(const GroundAction& action) const;
  int64_t fixed_ns(const GroundAction& action) const;
  std::span<const Fact> changes(const State& s) const { return {changes_.data() + s.first, s.count}; }
  bool holds(std::span<const Fact> changes, const Fact& fact) const;
  /// At least so much is left; nothing where no plan leads on.
  std::optional<int64_t> left_ns(std::span<const Fact> changes, uint32_t place) const;
  /// Writes the changes after the action behind all others; false if there is no room.
  bool write_successor(uint32_t from, const GroundAction& action);
  void expand(uint32_t from);
  uint32_t& slot_of(const State& state);
  void write_steps(uint32_t end, Plan& plan) const;

  SearchCapacity capacity_;
  const Domain* domain_ = nullptr;
  std::vector<State> states_;
  std::vector<Fact> changes_;
  std::vector<uint32_t> slots_;  ///< states by hash
  navigation::IndexedHeap<Key> open_;
  std::vector<uint32_t> worth_;   ///< actions that a plan below the limit may have
  std::vector<int64_t> goal_ns_;  ///< share of a goal's cheapest action; -1: none gives it
  int64_t limit_ns_ = 0;          ///< only plans below this are of use
  bool full_ = false;
  Plan plan_;
};

}  // namespace takt::planner
