// SPDX-License-Identifier: Apache-2.0
// What a traced run notes. Plain data of one size: it lies in memory that the processes of a run share.
#pragma once
#include <cstdint>

namespace takt::trace {

enum class Kind : uint8_t { release, latch, start, finish, publish, miss, skip, overrun, level, mode };

/// One event of one job. `value` and `extra` by kind:
///
/// | kind    | at                | value             | extra              | port            |
/// | release | planned release   | absolute deadline | -                  | -               |
/// | start   | start             | -                 | CPU                | level           |
/// | latch   | start             | sequence          | stamp              | index of edge   |
/// | finish  | end of run()      | CPU time, ns      | CPU                | -               |
/// | publish | publication       | sequence          | stamp              | index of output |
/// | miss    | absolute deadline | lateness, ns      | -                  | -               |
/// | skip    | skipped release   | -                 | -                  | -               |
/// | overrun | end of run()      | CPU time, ns      | budget, ns         | -               |
/// | level   | change            | new level         | -                  | -               |
/// | mode    | change            | number of mode    | -                  | -, and no task  |
///
/// Instants are CLOCK_MONOTONIC, ns. Every finished job gives one `publish` for its end, sequence 0 if nothing was
/// sent.
struct Event {
  int64_t at_ns = 0, value = 0, extra = 0;
  uint32_t job = 0;
  uint16_t task = 0;  ///< index into the plan
  Kind kind = Kind::release;
  uint8_t port = 0;
};
static_assert(sizeof(Event) == 32);

inline constexpr uint16_t kNoTask = UINT16_MAX;

}  // namespace takt::trace
