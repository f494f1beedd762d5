// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <map>
#include <vector>

#include "rt/record/recorded_job.hpp"
#include "rt/trace/event.hpp"

namespace takt::record {

/// Puts the events of the threads together to the jobs they tell of. A job of which an event was lost is counted, not
/// told. One thread at a time.
class JobAssembler {
 public:
  explicit JobAssembler(std::function<void(const RecordedJob&)> take) : take_(std::move(take)) {}

  /// The next event of that thread.
  void add(int32_t thread, const trace::Event& event);
  /// Jobs that began or ended in the events, but lacked some.
  uint64_t incomplete() const { return incomplete_; }

 private:
  struct Thread {
    RecordedJob job;
    bool open = false;         ///< between the release of a job and its end
    uint64_t lost_before = 0;  ///< events, as the last job's end told
  };
  /// Of a parameter, as far as it has come.
  struct Text {
    int64_t at_ns = 0;
    std::string words;
  };
  void open(Thread& thread, const trace::Event& event);
  void close(Thread& thread, const trace::Event& event);
  static void fill(RecordedJob& job, const trace::Event& event);
  void param(const trace::Event& event);

  std::function<void(const RecordedJob&)> take_;
  std::map<int32_t, Thread> threads_;
  std::map<uint16_t, std::vector<RecordedJob::Param>> params_;  ///< by task: for its next whole job
  std::map<uint16_t, Text> texts_;                              ///< by task
  uint64_t incomplete_ = 0;
};

}  // namespace takt::record
