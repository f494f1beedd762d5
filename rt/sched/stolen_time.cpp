// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stolen_time.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace takt {

int64_t read_stolen_ns() {
  static const int file = open("/proc/stat", O_RDONLY | O_CLOEXEC);
  static const int64_t tick_ns = 1'000'000'000 / sysconf(_SC_CLK_TCK);
  std::array<char, 256> line{};
  if (file < 0 || pread(file, line.data(), line.size() - 1, 0) <= 0) return 0;
  long long steal = 0;  // cpu user nice system idle iowait irq softirq steal
  return std::sscanf(line.data(), "cpu %*d %*d %*d %*d %*d %*d %*d %lld", &steal) == 1 ? steal * tick_ns : 0;
}

void StolenTime::look(int64_t now_ns) {
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
