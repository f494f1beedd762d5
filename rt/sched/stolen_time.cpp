// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stolen_time.hpp"

#include <algorithm>

namespace takt {

void StolenTime::look(int64_t now_ns) {
  if (!counted()) return;
  if (count_ > 0 && now_ns - readings_[(count_ - 1) % readings_.size()].at_ns < kStep_ns) return;
  readings_[count_++ % readings_.size()] = {now_ns, read_()};
}

int64_t StolenTime::recent_ns() const {
  if (count_ < 2) return 0;
  const Reading& last = readings_[(count_ - 1) % readings_.size()];
  const Reading* first = &last;
  for (size_t i = count_ > readings_.size() ? count_ - readings_.size() : 0; i < count_; ++i) {
    const Reading& reading = readings_[i % readings_.size()];
    if (reading.at_ns >= last.at_ns - kWindow_ns && reading.at_ns < first->at_ns) first = &reading;
  }
  return std::max<int64_t>(0, last.total_ns - first->total_ns);
}

}  // namespace takt
