// SPDX-License-Identifier: Apache-2.0
#include "nodes/head_behaviour/eyelids.hpp"

#include <cmath>

namespace takt::head_behaviour {
namespace {

int64_t nanoseconds(double s) { return std::llround(s * 1e9); }

}  // namespace

void SunGuard::see(bool saturated, int64_t stamp_ns, int64_t now_ns) {
  if (stamp_ns <= seen_ns_ || closed(now_ns)) return;
  if (open_from_ns_ != INT64_MIN && stamp_ns < open_from_ns_ + nanoseconds(parameters_.lift_s)) return;
  seen_ns_ = stamp_ns;
  saturated_ = saturated ? saturated_ + 1 : 0;
  if (saturated_ < parameters_.confirm) return;
  open_from_ns_ = now_ns + nanoseconds(parameters_.shut_s);
  saturated_ = 0;
}

bool Blinker::closed(bool has_partner, int64_t now_ns) {
  const auto later = [&] {
    std::uniform_real_distribution<double> share(0.5, 1.5);
    return now_ns + nanoseconds(share(random_) * parameters_.every_s);
  };
  if (!has_partner) {
    next_ns_.reset();
    return false;
  }
  if (!next_ns_ || now_ns >= *next_ns_ + nanoseconds(parameters_.closed_s)) next_ns_ = later();
  return now_ns >= *next_ns_;
}

}  // namespace takt::head_behaviour
