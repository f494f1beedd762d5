// SPDX-License-Identifier: Apache-2.0
// Which nodes are needed where the robot is: body poses near humans, signs near crossings (thesis Sec. 5.3.2; R-14).
#pragma once
#include <optional>
#include <span>

#include "nodes/semantic/script.hpp"
#include "rt/state_archive.hpp"

namespace takt::semantic {

struct Neighbour {
  std::string_view type;
  double distance_m = 0;
};

/// What is around the robot at an instant. None: nobody tells.
struct Surroundings {
  std::optional<std::span<const Neighbour>> objects;
  std::optional<bool> crossing;
};

struct NeedParameters {
  double margin_m = 0.5;            ///< while a node is needed, objects count that are so much farther away
  int64_t hold_ns = 2'000'000'000;  ///< a need lasts so long after its condition was last true
};

/// Memory is taken by the constructor. One thread at a time.
class Needs {
 public:
  Needs() = default;
  Needs(std::vector<Rule> rules, const NeedParameters& parameters);
  void tune(const NeedParameters& parameters) { parameters_ = parameters; }

  /// `now_ns` never less than in the call before. Where nobody tells of what a rule asks for, its node is needed: who
  /// does not know saves nothing.
  void update(const Surroundings& around, int64_t now_ns);

  std::span<const Rule> rules() const { return rules_; }
  bool needed(size_t rule) const { return states_[rule].needed; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, states_); }

 private:
  struct State {
    bool needed = true;
    std::optional<int64_t> true_ns;  ///< when the condition was last true
  };
  /// Whether its condition is true now, with so much added to its distance.
  static bool is_true(const Rule& rule, const Surroundings& around, double margin_m);

  std::vector<Rule> rules_;
  std::vector<State> states_;
  NeedParameters parameters_;
};

}  // namespace takt::semantic
