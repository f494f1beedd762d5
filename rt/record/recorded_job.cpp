// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorded_job.hpp"

#include <bit>

#include "rt/record/mcap/bytes.hpp"

namespace takt::record {
namespace {

using mcap::ByteReader;
using mcap::ByteWriter;

/// One walk over the members serves both directions: `Out` appends them, `In` fills them in.
class Out {
 public:
  explicit Out(std::vector<std::byte>& to) : writer_(to) {}
  template <class T>
  void number(const T& value) {
    writer_.number(static_cast<std::make_unsigned_t<T>>(value));
  }
  void flag(const bool& value) { number(static_cast<uint8_t>(value)); }
  template <class T, class Each>
  void list(const std::vector<T>& elements, const Each& each) {
    number(static_cast<uint32_t>(elements.size()));
    for (const T& element : elements) each(element);
  }
  void question(const Question& value) { number(static_cast<uint8_t>(value)); }
  void value(const ParamValue& value) {
    number(static_cast<uint8_t>(value.index()));
    if (const auto* flag = std::get_if<bool>(&value)) this->flag(*flag);
    if (const auto* whole = std::get_if<int64_t>(&value)) number(*whole);
    if (const auto* real = std::get_if<double>(&value)) number(std::bit_cast<uint64_t>(*real));
    if (const auto* text = std::get_if<std::string>(&value)) writer_.text(*text);
  }

 private:
  ByteWriter writer_;
};

class In {
 public:
  explicit In(mcap::Bytes from) : reader_(from) {}
  size_t left() const { return reader_.left(); }
  template <class T>
  void number(T& value) {
    value = static_cast<T>(reader_.number<std::make_unsigned_t<T>>());
  }
  void flag(bool& value) { value = reader_.number<uint8_t>() != 0; }
  template <class T, class Each>
  void list(std::vector<T>& elements, const Each& each) {
    const auto count = reader_.number<uint32_t>();
    if (count > left()) throw mcap::TooShort();  // an element has at least one byte
    elements.resize(count);
    for (T& element : elements) each(element);
  }
  void question(Question& value) {
    const auto number = reader_.number<uint8_t>();
    if (number > static_cast<uint8_t>(Question::done))
      throw std::runtime_error("a job asked what there is not to ask");
    value = static_cast<Question>(number);
  }
  void value(ParamValue& value) {
    switch (reader_.number<uint8_t>()) {
      case 0: value = reader_.number<uint8_t>() != 0; return;
      case 1: value = static_cast<int64_t>(reader_.number<uint64_t>()); return;
      case 2: value = std::bit_cast<double>(reader_.number<uint64_t>()); return;
      case 3: value = reader_.text(); return;
      default: throw std::runtime_error("a parameter is of no known kind");
    }
  }

 private:
  ByteReader reader_;
};

template <class Walk, class Job>
void walk(Walk& at, Job& job) {
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
}

}  // namespace

void pack(const RecordedJob& job, std::vector<std::byte>& to) {
  Out out(to);
  walk(out, job);
}

tl::expected<RecordedJob, std::string> unpack_job(std::span<const std::byte> packed) {
  RecordedJob job;
  In in(packed);
  try {
    walk(in, job);
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
         "[u8 question (0 now, 1 time_left, 2 chunk), i64 answer] answers, "
         "[u16 output, u8 repeated, u64 sequence] outputs; little-endian, [..] is u32 count and the elements";
}

}  // namespace takt::record
