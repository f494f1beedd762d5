// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/level.hpp>: core, stable.
// Quality levels: how a node says that it can do its work in a cheaper way.
#pragma once
#include <cstddef>
#include <initializer_list>
#include <string_view>

namespace takt {

class Node;

inline constexpr size_t kMaxLevels = 4;

/// One way of doing a node's work.
struct QualityLevel {
  std::string_view name;
  double cost = 1;  ///< CPU time of a job relative to level 0, an estimate; the first is 1, each next one smaller
  std::string_view doc = {};
};

/// Declares the levels of a node, best first; a member of the node, like its ports and parameters. A node without this
/// member has one level. Which one a job is to use, Job::level() says; it is 0 unless the schedule asks for
/// `on_overrun: degrade`. Every level gives the same outputs with the same meaning, only worse.
class Levels {
 public:
  /// Throws std::logic_error if there are none or more than kMaxLevels, or if costs do not fall from 1 towards 0.
  Levels(Node* owner, std::initializer_list<QualityLevel> levels);
  Levels(const Levels&) = delete;
  Levels& operator=(const Levels&) = delete;
};

}  // namespace takt
