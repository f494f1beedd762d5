// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/source_state.hpp>: core, stable.
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

/// What has come from a source since the start of its process, and what has not; 0 where a source does not count.
struct SourceCounts {
  uint64_t received = 0;  ///< frames, sweeps and telegrams that could be used
  uint64_t damaged = 0;   ///< refused: a checksum, a length, a flag or a value that none can have
  uint64_t resyncs = 0;   ///< how often bytes belonged to nothing, until a telegram began
  uint64_t missing = 0;   ///< gaps in the source's own count
  uint64_t unsent = 0;    ///< what was to be sent to it and could not be
  bool lossless() const { return damaged == 0 && resyncs == 0 && missing == 0 && unsent == 0; }
};

/// What a job says of its source.
struct SourceReport {
  SourceState state = SourceState::ok;
  uint64_t reopen_tries = 0;  ///< since the start of its process
  SourceCounts counts = {};
  /// Why nothing comes, or what is not as it was asked for; a literal, empty if all is well. All processes of a run are
  /// forks of one program: it is the same in each.
  const char* trouble = "";
};

}  // namespace takt
