// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/clock_map.hpp"

#include <algorithm>

namespace takt::semantic_link {
namespace {

/// Beyond a day either way no sum of instants overflows, and no round trip says anything.
constexpr int64_t kLongest_ns = 86'400'000'000'000;

bool ordered(int64_t before_ns, int64_t after_ns) {
  int64_t between_ns = 0;
  return !__builtin_sub_overflow(after_ns, before_ns, &between_ns) && between_ns >= 0 && between_ns <= kLongest_ns;
}

}  // namespace

void ClockMap::observe(int64_t sent_ns, int64_t heard_ns, int64_t answered_ns, int64_t now_ns) {
  if (!ordered(sent_ns, now_ns) || !ordered(heard_ns, answered_ns)) return;
  const int64_t away_ns = now_ns - sent_ns, there_ns = answered_ns - heard_ns;
  int64_t to_own_ns = 0;
  if (there_ns > away_ns || __builtin_sub_overflow(sent_ns, heard_ns, &to_own_ns)) return;
  samples_[count_++ % kSamples] = {away_ns - there_ns, to_own_ns + (away_ns - there_ns) / 2};
}

std::optional<int64_t> ClockMap::own_ns(int64_t others_ns) const {
  int64_t own_ns = 0;
  if (!known() || __builtin_add_overflow(others_ns, to_own_ns(), &own_ns)) return std::nullopt;
  return own_ns;
}

const ClockMap::Sample& ClockMap::best() const {
  const auto end = samples_.begin() + static_cast<ptrdiff_t>(std::min(count_, kSamples));
  return *std::min_element(samples_.begin(), end,
                           [](const Sample& a, const Sample& b) { return a.round_trip_ns < b.round_trip_ns; });
}

}  // namespace takt::semantic_link
