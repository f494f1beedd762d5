// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/recorded_job.hpp>: record, experimental.
// What a job was given and what it did, as a record keeps it: enough to run it again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/node.hpp"

namespace takt::record {

/// The format that this program writes; it reads this one and those before it. README.md says what each has.
inline constexpr int kFormat = 3;  ///< pictures may be JPEG
inline constexpr int kFormatWithoutJpeg = 2;

struct RecordedJob {
  /// Consecutive messages that an edge held, oldest first.
  struct Run {
    uint64_t first = 0, count = 0;
    bool operator==(const Run&) const = default;
  };
  struct Input {
    uint16_t edge = 0;  ///< index into the task's edges
    bool stale = false;
    std::vector<Run> held;
    bool operator==(const Input&) const = default;
  };
  struct Output {
    uint16_t output = 0;  ///< index into the task's ports
    bool repeated = false;
    uint64_t sequence = 0;
    bool operator==(const Output&) const = default;
  };
  struct Answer {
    Question question = Question::now;
    int64_t value = 0;
    bool operator==(const Answer&) const = default;
  };
  struct Param {
    uint16_t param = 0;  ///< index into Node::params()
    ParamValue value;
    bool operator==(const Param&) const = default;
  };

  uint16_t task = 0;   ///< index into Plan::tasks
  uint32_t index = 0;  ///< Job::index()
  int64_t release_ns = 0, deadline_ns = 0, start_ns = 0, finish_ns = 0, published_ns = 0, cpu_ns = 0;
  int32_t level = 0;
  uint32_t mode = 0;  ///< index into Plan::modes
  bool late = false;
  int64_t visible_at_ns = 0;  ///< of what it published; 0 in format 1, which does not say
  /// Its process ended during it. `outputs` are those that it was about to publish: which of them came out, the next
  /// restart of the task says (Restart::Output::newest). Without an output nothing of it came out.
  bool cut_off = false;
  std::vector<Param> params;  ///< changed just before this job
  std::vector<Input> inputs;  ///< only of edges that held something or were stale
  std::vector<Answer> answers;
  std::vector<Output> outputs;
  bool operator==(const RecordedJob&) const = default;
};

/// Little-endian bytes, in the order of the members; a vector is its number of elements (u32) and the elements.
/// `visible_at_ns` and `cut_off` come last, and not in format 1.
void pack(const RecordedJob& job, std::vector<std::byte>& to, int format = kFormat);
/// Error: the bytes end too early or too late, or hold a value that there is not.
tl::expected<RecordedJob, std::string> unpack_job(std::span<const std::byte> packed, int format = kFormat);

/// How pack() lays a job out, for readers of a record.
const char* job_layout();

}  // namespace takt::record
