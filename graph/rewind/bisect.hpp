// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "graph/rewind/recorded_run.hpp"

namespace takt::rewind {

struct FoundBreak {
  std::string node;
  uint32_t job = 0;
  int64_t release_ns = 0;
  std::string value;  ///< of its message
};

struct Bisected {
  std::string condition;
  size_t replays = 0;
  int64_t replayed_ns = 0;          ///< of recorded time, all of them together
  std::optional<FoundBreak> first;  ///< none: nothing breaks it, as far as was looked
};

/// The first job whose message breaks the condition (`holds: always`, the default: it fails the test; `never`: it
/// passes), by halves: what has broken stays broken, or else this finds one of the places where it breaks. About
/// log2(snapshots) replays of a few seconds each, and one from the last snapshot at which it held.
Bisected bisect(RecordedRun& run, const graph::ConditionSpec& condition);

}  // namespace takt::rewind
