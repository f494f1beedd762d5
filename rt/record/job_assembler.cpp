// SPDX-License-Identifier: Apache-2.0
#include "rt/record/job_assembler.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "rt/sched/run_board.hpp"

namespace takt::record {

using trace::Event;
using trace::Kind;

namespace {

RecordedJob::Input& input_of(RecordedJob& job, const Event& event) {
  for (RecordedJob::Input& input : job.inputs)
    if (input.edge == event.port) return input;
  return job.inputs.emplace_back(RecordedJob::Input{event.port, false, {}});
}

}  // namespace

void JobAssembler::add(int32_t id, const Event& event) {
  Ring& ring = rings_[id];
  switch (event.kind) {
    case Kind::param:
      if (auto value = value_of(ring, event)) param(event, std::move(*value));
      return;
    case Kind::release: return open(ring, event);
    case Kind::handed:
    case Kind::seen:
    case Kind::kept:
    case Kind::restart: return restart(ring, event);
    default: break;
  }
  const bool answers = event.kind == Kind::answer, ends = event.kind == Kind::publish && event.value == 0;
  const auto found = ring.open.find(answers ? ring.at_work : event.task);
  // What belongs to no job in hand: a skipped release, or the rest of a job whose beginning is lost.
  if (found == ring.open.end() || (!answers && event.job != found->second.job.index)) {
    if (!ends) return;
    ring.lost = event.extra;
    ++incomplete_;
    return;
  }
  if (!ends) return fill(found->second, event);
  close(ring, found->second, event);
  ring.open.erase(found);
}

void JobAssembler::end() {
  for (auto& [id, ring] : rings_) {
    for (const auto& [task, open] : ring.open) cut_off(open);
    ring.open.clear();
  }
}

void JobAssembler::open(Ring& ring, const Event& event) {
  const auto [slot, fresh] = ring.open.try_emplace(event.task);
  Open& open = slot->second;
  // Its thread died, and another goes on with its ring; or its end is lost.
  if (!fresh) {
    open.whole = open.whole && open.lost == event.extra;
    cut_off(open);
    open = {};
  }
  // What was lost between two jobs may have been a parameter.
  open.whole = std::exchange(ring.lost, event.extra) == event.extra;
  open.lost = event.extra;
  ring.at_work = event.task;
  open.job.task = event.task;
  open.job.index = event.job;
  open.job.release_ns = event.at_ns;
  open.job.deadline_ns = event.value;
  open.job.params = params_[event.task];
}

void JobAssembler::close(Ring& ring, Open& open, const Event& event) {
  ring.lost = event.extra;
  open.job.published_ns = event.at_ns;
  if (open.job.visible_at_ns == 0) open.job.visible_at_ns = event.at_ns;
  if (!open.whole || open.lost != event.extra) {
    ++incomplete_;
    return;
  }
  take_job_(open.job);
  params_[event.task].clear();
}

void JobAssembler::cut_off(const Open& open) {
  if (!open.whole) {
    ++incomplete_;
    return;
  }
  RecordedJob job = open.job;
  job.cut_off = true;
  if (job.published_ns == 0) job.published_ns = job.finish_ns == 0 ? job.start_ns : job.finish_ns;
  job.visible_at_ns = job.published_ns;
  job.outputs = open.offered;
  take_job_(job);
}

void JobAssembler::offer(Open& open, const Event& event) {
  open.whole = open.whole && open.lost == event.extra >> 1;
  open.job.finish_ns = event.at_ns;
  // The last word counts: a message that came too late is taken back, and the one before it offered again.
  std::erase_if(open.offered, [&](const RecordedJob::Output& before) { return before.output == event.port; });
  open.offered.push_back({event.port, (event.extra & 1) != 0, static_cast<uint64_t>(event.value)});
}

void JobAssembler::restart(Ring& ring, const Event& event) {
  Restart* under_way = std::get_if<Restart>(&ring.restart.what);
  const RecordedEvent& before = ring.restart;
  if (under_way == nullptr || before.task != event.task || before.job != event.job || before.at_ns != event.at_ns) {
    ring.restart = {static_cast<uint16_t>(EventKind::restart), event.task, event.job, event.at_ns, Restart{}};
    under_way = &std::get<Restart>(ring.restart.what);
  }
  const auto number = static_cast<uint64_t>(event.value);
  if (event.kind == Kind::handed)
    under_way->outputs.push_back({event.port, number, static_cast<uint64_t>(event.extra)});
  if (event.kind == Kind::seen) under_way->seen.push_back({event.port, number});
  if (event.kind == Kind::kept)
    if (auto value = value_of(ring, event)) under_way->params.push_back({event.port, std::move(*value)});
  if (event.kind != Kind::restart) return;
  under_way->level = static_cast<int32_t>(event.value);
  restarted_ns_[event.task] = event.at_ns;
  params_[event.task].clear();
  if (const auto died = ring.open.find(event.task); died != ring.open.end()) {
    died->second.whole = died->second.whole && died->second.lost == event.extra;
    cut_off(died->second);
    ring.open.erase(died);
  }
  if (std::exchange(ring.lost, event.extra) == event.extra) take_event_(ring.restart);
  else ++incomplete_;
  ring.restart = {};
}

void JobAssembler::fill(Open& open, const Event& event) {
  RecordedJob& job = open.job;
  const auto number = static_cast<uint64_t>(event.value);
  switch (event.kind) {
    case Kind::start:
      job.start_ns = event.at_ns;
      job.level = event.port;
      // As the job saw it: a mode that is asked for too late for it may hold from before its release.
      job.mode = static_cast<uint32_t>(event.value);
      break;
    case Kind::stale: input_of(job, event).stale = true; break;
    case Kind::latch: input_of(job, event).held = {{number, 1}}; break;
    case Kind::held: {
      auto& held = input_of(job, event).held;
      // What `latch` told was the newest; the runs tell it again, with those before it.
      if (held.size() == 1 && held.front().count == 1 && number <= held.front().first) held.clear();
      held.push_back({number, static_cast<uint64_t>(event.extra)});
      break;
    }
    case Kind::answer: job.answers.push_back({static_cast<Question>(event.extra), event.value}); break;
    case Kind::finish:
      job.finish_ns = event.at_ns;
      job.cpu_ns = event.value;
      break;
    case Kind::miss: job.late = true; break;
    case Kind::publish: job.outputs.push_back({event.port, false, number}); break;
    case Kind::repeat: job.outputs.push_back({event.port, true, number}); break;
    case Kind::offer: return offer(open, event);
    case Kind::visible: job.visible_at_ns = event.value; break;
    default: break;
  }
}

/// Once its last piece has come.
std::optional<ParamValue> JobAssembler::value_of(Ring& ring, const Event& event) {
  switch (static_cast<PlainParam::Kind>(event.extra & 0xff)) {
    case PlainParam::flag: return event.value != 0;
    case PlainParam::integer: return event.value;
    case PlainParam::number: return std::bit_cast<double>(event.value);
    case PlainParam::text: break;
  }
  if (const std::pair of(event.task, event.at_ns); std::exchange(ring.text_of, of) != of)
    ring.text.clear();  // its process died within the one before
  std::array<char, sizeof event.value + 1> piece{};
  std::memcpy(piece.data(), &event.value, sizeof event.value);
  ring.text += piece.data();
  if (std::strlen(piece.data()) == sizeof event.value) return std::nullopt;
  return std::exchange(ring.text, {});
}

void JobAssembler::param(const Event& event, ParamValue value) {
  // The ring of a process that died may be read after that of the next one.
  if (event.at_ns >= restarted_ns_[event.task]) params_[event.task].push_back({event.port, value});
  take_event_({static_cast<uint16_t>(EventKind::parameter), event.task, event.job, event.at_ns,
               ParameterSet{event.port, std::move(value), "uid " + std::to_string(event.extra >> 8)}});
}

}  // namespace takt::record
