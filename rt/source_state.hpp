// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace takt {

/// Whether what a task reads from outside the run gives good data; all but `ok` count as lost.
enum class SourceState : uint32_t {
  ok,
  silent,        ///< no good data for a while
  disconnected,  ///< its driver says that it is gone
  garbage,       ///< nothing but damaged data for a while
  frozen,        ///< nothing but repetitions for a while
  unattended,    ///< the process that reads it is dead
};

inline const char* to_text(SourceState state) {
  switch (state) {
    case SourceState::ok: return "ok";
    case SourceState::silent: return "silent";
    case SourceState::disconnected: return "disconnected";
    case SourceState::garbage: return "garbage";
    case SourceState::frozen: return "frozen";
    case SourceState::unattended: return "unattended";
  }
  return "?";
}

/// What a job says of its source.
struct SourceReport {
  SourceState state = SourceState::ok;
  uint64_t reopen_tries = 0;  ///< since the start of its process
};

}  // namespace takt
