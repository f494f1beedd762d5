// SPDX-License-Identifier: Apache-2.0
// What a task notes where its thread is traced.
#include <sched.h>

#include <bit>
#include <cstring>

#include "rt/sched/port_access.hpp"
#include "rt/sched/task.hpp"
#include "rt/trace/rings.hpp"

namespace takt {

void Task::trace_start() const {
  const auto task = static_cast<uint16_t>(index_);
  const auto job = static_cast<uint32_t>(ended_.index);
  const auto lost = static_cast<int64_t>(trace::lost());
  trace::record({ended_.release_ns, ended_.release_ns + plan_.deadline_ns, lost, job, task, trace::Kind::release, 0});
  trace::record({ended_.started_ns, ended_.mode, modelled_ ? 0 : sched_getcpu(), job, task, trace::Kind::start,
                 static_cast<uint8_t>(ended_.level)});
}

void Task::trace_param(trace::Kind kind, size_t param, const PlainParam& given) const {
  const auto note = [&](int64_t value) {
    trace::record({ended_.started_ns, value, given.kind | int64_t{given.by_user} << 8,
                   static_cast<uint32_t>(ended_.index), static_cast<uint16_t>(index_), kind,
                   static_cast<uint8_t>(param)});
  };
  switch (given.kind) {
    case PlainParam::number: return note(std::bit_cast<int64_t>(given.real));
    case PlainParam::flag:
    case PlainParam::integer: return note(given.whole);
    case PlainParam::text: break;
  }
  for (size_t at = 0; at == 0 || std::memchr(given.words.characters.data() + at - 8, 0, 8) == nullptr; at += 8) {
    int64_t piece = 0;
    std::memcpy(&piece, given.words.characters.data() + at, sizeof piece);
    note(piece);
  }
}

void Task::trace_inputs() const {
  const auto note = [&](trace::Kind kind, size_t edge, uint64_t value, int64_t extra) {
    trace::record({ended_.started_ns, static_cast<int64_t>(value), extra, static_cast<uint32_t>(ended_.index),
                   static_cast<uint16_t>(index_), kind, static_cast<uint8_t>(edge)});
  };
  for (size_t e = 0; e < plan_.edges.size(); ++e) {
    InputPort& input = *plan_.node->inputs()[plan_.edges[e].input];
    if (input.stale()) note(trace::Kind::stale, e, 0, 0);
    const size_t count = PortAccess::held_count(input);
    if (count == 0) continue;
    const auto& held = PortAccess::held(input);
    note(trace::Kind::latch, e, held[count - 1].sequence, held[count - 1].stamp_ns);
    for (size_t from = 0, to = 1; count > 1 && from < count; from = to++) {
      while (to < count && held[to].sequence == held[to - 1].sequence + 1) ++to;
      note(trace::Kind::held, e, held[from].sequence, static_cast<int64_t>(to - from));
    }
  }
}

void Task::trace_offer(size_t output, bool repeat) const {
  const auto lost = static_cast<int64_t>(trace::lost());
  trace::record({ended_.end.finished_ns, static_cast<int64_t>(sequences_[output] + 1), 2 * lost + (repeat ? 1 : 0),
                 static_cast<uint32_t>(ended_.index), static_cast<uint16_t>(index_), trace::Kind::offer,
                 static_cast<uint8_t>(output)});
}

void Task::trace_restart() const {
  const auto note = [&](trace::Kind kind, size_t port, uint64_t value, uint64_t extra) {
    trace::record({ended_.started_ns, static_cast<int64_t>(value), static_cast<int64_t>(extra),
                   static_cast<uint32_t>(ended_.index), static_cast<uint16_t>(index_), kind,
                   static_cast<uint8_t>(port)});
  };
  for (size_t i = 0; i < handed_.size(); ++i) note(trace::Kind::handed, i, handed_[i], sequences_[i]);
  for (size_t e = 0; e < plan_.edges.size(); ++e) note(trace::Kind::seen, e, latch_.statistics(e).last_seen, 0);
  // What start() took up: only this thread keeps another value, and has taken none yet.
  for (size_t p = 0; p < board_.param_count(index_); ++p)
    if (const KeptParam::Value* kept = board_.kept(index_, p).newest()) trace_param(trace::Kind::kept, p, *kept);
  note(trace::Kind::restart, 0, static_cast<uint64_t>(quality_.level()), trace::lost());
}

void Task::trace_end() const {
  const JobEnd& end = ended_.end;
  const int64_t deadline_ns = ended_.release_ns + plan_.deadline_ns;
  const int64_t cpu_ns = ended_.exec_ns;
  const auto note = [&](trace::Kind kind, int64_t at_ns, int64_t value, int64_t extra = 0, size_t port = 0) {
    trace::record({at_ns, value, extra, static_cast<uint32_t>(ended_.index), static_cast<uint16_t>(index_), kind,
                   static_cast<uint8_t>(port)});
  };
  note(trace::Kind::finish, end.finished_ns, cpu_ns, ended_.cpu);
  if (plan_.budget_ns > 0 && cpu_ns > plan_.budget_ns)
    note(trace::Kind::overrun, end.finished_ns, cpu_ns, plan_.budget_ns);
  if (end.late) note(trace::Kind::miss, deadline_ns, ended_.published_ns - deadline_ns);
  for (size_t i = 0; i < sequences_.size(); ++i) {
    if (sent_stamps_ns_[i] != kNothingSent)
      note(trace::Kind::publish, ended_.published_ns, static_cast<int64_t>(sequences_[i]), sent_stamps_ns_[i], i);
    else if (published_[i]) note(trace::Kind::repeat, ended_.published_ns, static_cast<int64_t>(sequences_[i]), 0, i);
  }
  if (end.visible_at_ns != ended_.published_ns) note(trace::Kind::visible, ended_.published_ns, end.visible_at_ns);
  note(trace::Kind::publish, ended_.published_ns, 0, static_cast<int64_t>(trace::lost()));
}

}  // namespace takt
