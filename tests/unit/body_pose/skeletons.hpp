// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "nodes/body_pose/skeleton.hpp"

namespace takt::test {

/// The shipped skeleton of that name.
inline body_pose::Skeleton shipped(const std::string& name) {
  return body_pose::read_skeleton(std::string(TAKT_SOURCE_DIR) + "/graph/skeletons/" + name + ".txt");
}

/// For a search that has time as long as it likes.
inline constexpr auto kWithoutEnd = [] { return true; };

}  // namespace takt::test
