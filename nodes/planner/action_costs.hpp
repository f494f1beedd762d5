// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>
#include <map>

#include "nodes/semantic/network.hpp"
#include "rt/state_archive.hpp"

namespace takt::planner {

using semantic::NodeId;

/// What actions take, learned from those that were done: the running mean of what was declared, as one observation, and
/// what was measured; each new one weighs at least a tenth, so that a change of the world is followed.
class ActionCosts {
 public:
  double cost_s(NodeId action, double declared_s) const {
    const auto known = learned_.find(action);
    return known == learned_.end() ? declared_s : known->second.mean_s;
  }
  /// `took_s` >= 0. Takes memory at an action's first time.
  void learn(NodeId action, double declared_s, double took_s) {
    Learned& l = learned_.try_emplace(action, Learned{declared_s, 1, 0}).first->second;
    l.count = std::min<uint32_t>(l.count + 1, 10);
    l.mean_s += (took_s - l.mean_s) / l.count;
    ++l.times;
  }
  /// visit(action, mean in s, how often it was done) for each that was.
  template <class Visit>
  void each(Visit visit) const {
    for (const auto& [action, learned] : learned_) visit(action, learned.mean_s, learned.times);
  }
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, learned_);
    archive.room(kMostRemembered * (sizeof(NodeId) + sizeof(Learned)));
  }

 private:
  struct Learned {
    double mean_s = 0;
    uint32_t count = 0, times = 0;
  };
  static constexpr size_t kMostRemembered = 256;
  std::map<NodeId, Learned> learned_;
};

}  // namespace takt::planner
