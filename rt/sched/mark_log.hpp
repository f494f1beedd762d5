// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "rt/sched/append_log.hpp"

namespace takt {

/// Words that a person set at an instant of a run (`takt mark`).
struct Mark {
  int64_t at_ns = 0;
  uint32_t by_user = 0;  ///< uid
  BoundedText<200> words;
};

inline constexpr size_t kMostMarks = 512;
using MarkLog = AppendLog<Mark, kMostMarks>;

}  // namespace takt
