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
  Thread& thread = threads_[id];
  if (event.kind == Kind::param) return param(event);
  if (event.kind == Kind::release) return open(thread, event);
  const bool answers = event.kind == Kind::answer;
  // What belongs to no job in hand: a skipped release, or the rest of a job whose beginning is lost.
  if (!thread.open || (!answers && (event.task != thread.job.task || event.job != thread.job.index))) {
    if (event.kind == Kind::publish && event.value == 0) {
      thread.lost_before = static_cast<uint64_t>(event.extra);
      ++incomplete_;
    }
    return;
  }
  if (event.kind == Kind::publish && event.value == 0) return close(thread, event);
  fill(thread.job, event);
}

void JobAssembler::open(Thread& thread, const Event& event) {
  if (std::exchange(thread.open, true)) ++incomplete_;
  thread.job = {};
  thread.job.task = event.task;
  thread.job.index = event.job;
  thread.job.release_ns = event.at_ns;
  thread.job.deadline_ns = event.value;
  // A job that never ends, because its process dies, leaves them to the next one of the task.
  if (const auto changed = params_.find(event.task); changed != params_.end()) thread.job.params = changed->second;
}

void JobAssembler::close(Thread& thread, const Event& event) {
  thread.open = false;
  thread.job.published_ns = event.at_ns;
  const bool whole = std::exchange(thread.lost_before, static_cast<uint64_t>(event.extra)) == thread.lost_before;
  if (!whole) {
    ++incomplete_;
    return;
  }
  take_(thread.job);
  params_.erase(thread.job.task);
}

void JobAssembler::fill(RecordedJob& job, const Event& event) {
  const auto number = static_cast<uint64_t>(event.value);
  switch (event.kind) {
    case Kind::start:
      job.start_ns = event.at_ns;
      job.level = event.port;
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
    default: break;
  }
}

void JobAssembler::param(const Event& event) {
  auto& params = params_[event.task];
  Text& text = texts_[event.task];
  if (std::exchange(text.at_ns, event.at_ns) != event.at_ns)
    text.words.clear();  // its process died within the one before
  switch (static_cast<ParamMail::Kind>(event.extra)) {
    case ParamMail::flag: params.push_back({event.port, event.value != 0}); return;
    case ParamMail::integer: params.push_back({event.port, event.value}); return;
    case ParamMail::number: params.push_back({event.port, std::bit_cast<double>(event.value)}); return;
    case ParamMail::text: break;
  }
  std::array<char, sizeof event.value + 1> piece{};
  std::memcpy(piece.data(), &event.value, sizeof event.value);
  text.words += piece.data();
  if (std::strlen(piece.data()) < sizeof event.value) params.push_back({event.port, std::exchange(text.words, {})});
}

}  // namespace takt::record
