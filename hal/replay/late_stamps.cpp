// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/late_stamps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::replay {

LineTimes repair_late_stamps(std::span<const double> seconds) {
  LineTimes lines;
  lines.time_ns.resize(seconds.size());
  std::vector<bool> trusted(seconds.size());
  int64_t least_later = std::numeric_limits<int64_t>::max();
  for (size_t i = seconds.size(); i-- > 0;) {
    const int64_t stamp = std::llround(seconds[i] * 1e9);
    lines.time_ns[i] = stamp;
    trusted[i] = stamp < least_later;
    least_later = std::min(least_later, stamp);
  }
  lines.first_known = static_cast<size_t>(std::find(trusted.begin(), trusted.end(), true) - trusted.begin());
  for (size_t before = lines.first_known, next = before + 1; next < seconds.size(); ++next) {
    if (!trusted[next]) continue;
    const int64_t from = lines.time_ns[before], span = lines.time_ns[next] - from;
    const auto parts = static_cast<int64_t>(next - before);
    for (int64_t part = 1; part < parts; ++part) {
      const auto share = static_cast<double>(part) / static_cast<double>(parts);
      lines.time_ns[before + static_cast<size_t>(part)] = from + std::llround(share * static_cast<double>(span));
    }
    lines.late += static_cast<size_t>(parts - 1);
    before = next;
  }
  return lines;
}

}  // namespace takt::replay
