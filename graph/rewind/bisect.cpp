// SPDX-License-Identifier: Apache-2.0
#include "graph/rewind/bisect.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "graph/rewind/seen_condition.hpp"
#include "graph/run/support.hpp"

namespace takt::rewind {
namespace {

class Bisection {
 public:
  Bisection(RecordedRun& run, const graph::ConditionSpec& spec)
      : run_(run), condition_(spec, run), breaks_(spec.holds == graph::Holds::never) {
    for (const record::RecordedEvent& event : run.log().events())
      if (std::holds_alternative<record::Snapshot>(event.what) && event.task == condition_.task())
        instants_.push_back(event.at_ns);
    std::sort(instants_.begin(), instants_.end());
    instants_.insert(instants_.begin(), INT64_MIN);  // the record's own begin
    told_.condition = condition_.text();
  }

  Bisected find() {
    size_t held = 0, broken = instants_.size() - 1;  // of the instants: the break lies between, as far as is known
    if (!look(broken, true)) return told_;           // it holds at the end
    while (held + 1 < broken && !command::StopOnSignal::asked()) {
      const size_t middle = held + (broken - held) / 2;
      (look(middle, false) ? broken : held) = middle;
    }
    // Between the two: behind the first message after `held`, up to the first one after `broken`.
    told_.first = look(held, true);
    return told_;
  }

 private:
  /// What breaks it: the first message from that instant on, or with `on` any one after it.
  std::optional<FoundBreak> look(size_t instant, bool on) {
    if (std::exchange(used_, true)) run_.compose_again();
    ++told_.replays;
    std::optional<FoundBreak> found;
    record::Replayer::Options how = run_.parts().front().how;
    how.pace = {};
    how.begin_ns = instants_[instant];
    how.visit = [&](const record::Replayer& replayer, const record::RecordedJob& job) {
      if (command::StopOnSignal::asked()) return false;
      const auto seen = job.start_ns >= how.begin_ns ? condition_.behind(replayer, job) : std::nullopt;
      if (!seen) return true;
      if (seen->passes == breaks_)
        found = FoundBreak{run_.plan().tasks[job.task].name, job.index, job.release_ns, seen->value};
      return on && !found;
    };
    told_.replayed_ns += run_.run(how).recorded_ns;
    return found;
  }

  RecordedRun& run_;
  const SeenCondition condition_;
  const bool breaks_;  ///< by passing
  std::vector<int64_t> instants_;
  Bisected told_;
  bool used_ = false;
};

}  // namespace

Bisected bisect(RecordedRun& run, const graph::ConditionSpec& condition) { return Bisection(run, condition).find(); }

}  // namespace takt::rewind
