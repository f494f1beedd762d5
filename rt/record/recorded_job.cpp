// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorded_job.hpp"

#include "rt/record/pack_walk.hpp"

namespace takt::record {
namespace {

template <class Walk, class Job>
void walk(Walk& at, Job& job, int format) {
  at.number(job.task), at.number(job.index);
  at.number(job.release_ns), at.number(job.deadline_ns), at.number(job.start_ns), at.number(job.finish_ns);
  at.number(job.published_ns), at.number(job.cpu_ns);
  at.number(job.level), at.number(job.mode), at.flag(job.late);
  at.list(job.params, [&](auto& param) { at.number(param.param), at.value(param.value); });
  at.list(job.inputs, [&](auto& input) {
    at.number(input.edge), at.flag(input.stale);
    at.list(input.held, [&](auto& run) { at.number(run.first), at.number(run.count); });
  });
  at.list(job.answers, [&](auto& answer) { at.question(answer.question), at.number(answer.value); });
  at.list(job.outputs,
          [&](auto& output) { at.number(output.output), at.flag(output.repeated), at.number(output.sequence); });
  if (format >= 2) at.number(job.visible_at_ns), at.flag(job.cut_off);
}

}  // namespace

void pack(const RecordedJob& job, std::vector<std::byte>& to, int format) {
  PackOut out(to);
  walk(out, job, format);
}

tl::expected<RecordedJob, std::string> unpack_job(std::span<const std::byte> packed, int format) {
  RecordedJob job;
  PackIn in(packed);
  try {
    walk(in, job, format);
  } catch (const std::runtime_error& problem) {
    return tl::make_unexpected(std::string(problem.what()));
  }
  if (in.left() > 0) return tl::make_unexpected(std::to_string(in.left()) + " bytes behind a job");
  return job;
}

const char* job_layout() {
  return "u16 task, u32 job, i64 release_ns, i64 deadline_ns, i64 start_ns, i64 finish_ns, i64 published_ns, i64 "
         "cpu_ns, "
         "i32 level, u32 mode, u8 late, [u16 param, u8 kind (0 flag, 1 integer, 2 number, 3 text), value] params, "
         "[u16 edge, u8 stale, [u64 first_sequence, u64 count] held] inputs, "
         "[u8 question (0 now, 1 time_left, 2 chunk, 3 done), i64 answer] answers, "
         "[u16 output, u8 repeated, u64 sequence] outputs, i64 visible_at_ns, u8 cut_off; little-endian, [..] is u32 "
         "count and the elements";
}

}  // namespace takt::record
