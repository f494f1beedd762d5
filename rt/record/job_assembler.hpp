// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rt/record/recorded_event.hpp"
#include "rt/record/recorded_job.hpp"
#include "rt/trace/event.hpp"

namespace takt::record {

/// Puts the events of the rings together to the jobs they tell of, and to what happened to tasks between them. A job of
/// which an event was lost is counted, not told. One that its process did not live to end is told as cut off: once its
/// ring goes on, or at the end. One thread at a time.
class JobAssembler {
 public:
  using TakeJob = std::function<void(const RecordedJob&)>;
  using TakeEvent = std::function<void(const RecordedEvent&)>;
  JobAssembler(TakeJob take_job, TakeEvent take_event)
      : take_job_(std::move(take_job)), take_event_(std::move(take_event)) {}

  /// The next event of that ring.
  void add(int32_t ring, const trace::Event& event);
  /// After the last event: tells the jobs that have no end.
  void end();
  /// Jobs that began or ended in the events, but lacked some; and restarts.
  uint64_t incomplete() const { return incomplete_; }

 private:
  struct Open {
    RecordedJob job;
    std::vector<RecordedJob::Output> offered;  ///< may have come out
    int64_t lost = 0;                          ///< events of the ring when it began: none may be lost until it ends
    bool whole = true;
  };
  /// The thread of a ring has one job at work, and may have others of its lane behind it that are not counted yet.
  struct Ring {
    std::map<uint16_t, Open> open;  ///< by task
    uint16_t at_work = trace::kNoTask;
    int64_t lost = 0;  ///< events, as it last told
    RecordedEvent restart;
    std::string text;                        ///< of a parameter, as far as it has come
    std::pair<uint16_t, int64_t> text_of{};  ///< task and instant
  };
  void open(Ring& ring, const trace::Event& event);
  void close(Ring& ring, Open& open, const trace::Event& event);
  void cut_off(const Open& open);
  static void fill(Open& open, const trace::Event& event);
  static void offer(Open& open, const trace::Event& event);
  void restart(Ring& ring, const trace::Event& event);
  void param(const trace::Event& event, ParamValue value);
  static std::optional<ParamValue> value_of(Ring& ring, const trace::Event& event);

  TakeJob take_job_;
  TakeEvent take_event_;
  std::map<int32_t, Ring> rings_;
  std::map<uint16_t, std::vector<RecordedJob::Param>> params_;  ///< by task: for its next whole job
  std::map<uint16_t, int64_t> restarted_ns_;  ///< by task: what is to be had of a value set before, the restart says
  uint64_t incomplete_ = 0;
};

}  // namespace takt::record
