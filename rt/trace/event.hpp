// SPDX-License-Identifier: Apache-2.0
// What a traced run notes. Plain data of one size: it lies in memory that the processes of a run share.
#pragma once
#include <cstdint>

namespace takt::trace {

enum class Kind : uint8_t {
  release,
  latch,
  start,
  finish,
  publish,
  miss,
  skip,
  overrun,
  level,
  mode,
  held,
  stale,
  repeat,
  answer,
  param,
  offer,
  visible,
  handed,
  seen,
  kept,
  restart
};

/// One event of one job. `value` and `extra` by kind:
///
/// | kind    | at                | value             | extra              | port            |
/// | release | planned release   | absolute deadline | events lost so far | -               |
/// | start   | start             | number of mode    | CPU                | level           |
/// | latch   | start             | sequence          | stamp              | index of edge   |
/// | finish  | end of run()      | CPU time, ns      | CPU                | -               |
/// | publish | publication       | sequence          | stamp              | index of output |
/// | miss    | absolute deadline | lateness, ns      | -                  | -               |
/// | skip    | skipped release   | -                 | -                  | -               |
/// | overrun | end of run()      | CPU time, ns      | budget, ns         | -               |
/// | level   | change            | new level         | -                  | -               |
/// | mode    | change            | number of mode    | -                  | -, and no task  |
/// | held    | start             | first sequence    | how many           | index of edge   |
/// | stale   | start             | -                 | -                  | index of edge   |
/// | repeat  | publication       | sequence          | -                  | index of output |
/// | answer  | -                 | answer            | Question           | -, and no task  |
/// | param   | start             | 8 bytes of value  | kind + 256 x uid   | index           |
/// | offer   | end of run()      | sequence          | 2 x lost, + repeat | index of output |
/// | visible | publication       | visible_at        | -                  | -               |
/// | handed  | start             | handed over, or 0 | newest sequence    | index of output |
/// | seen    | start             | newest latched    | -                  | index of edge   |
/// | kept    | start             | 8 bytes of value  | kind + 256 x uid   | index           |
/// | restart | start             | level             | events lost so far | -               |
///
/// Instants are CLOCK_MONOTONIC, ns. `latch` tells the newest message of an edge, `held` each run of consecutive ones
/// where there are several. Every finished job gives one more `publish` for its end, with sequence 0 and as `extra` the
/// events that its thread has lost so far: none may lack between two of them. What a job was given (`param` before its
/// release) comes first, then its answers, then the rest. The kind of a value is PlainParam::Kind, its uid that of the
/// user who gave it. A text is as many events as it fills, to its final 0.
///
/// `offer` comes before the message is announced to anybody. So what it takes to make a message again lies in the ring
/// before the first reader can see it, and a process may die at any instant. `visible` comes only where visible_at is
/// not the publication. `handed` of all outputs, `seen` of all edges and `kept` of the values that the node took up,
/// then `restart`, come before the first job of a task whose process was started again.
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
