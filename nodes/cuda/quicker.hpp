// SPDX-License-Identifier: Apache-2.0
// Whether a card is worth its use here: both sides try, on noise.
#pragma once
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "rt/time/clock.hpp"

namespace takt::cuda {

inline std::vector<uint8_t> noise(size_t bytes) {
  std::vector<uint8_t> values(bytes);
  uint32_t state = 1;
  for (uint8_t& value : values) value = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  return values;
}

/// Five tries of each, the shortest count; a card that does not do it (false) is not quicker. In virtual time it never
/// is.
template <class OnCard, class OnCpu>
bool is_quicker(const Clock& clock, OnCard on_card, OnCpu on_cpu) {
  constexpr int kTimes = 5;
  const auto shortest = [&](auto&& run) {
    int64_t best = std::numeric_limits<int64_t>::max();
    for (int i = 0; i < kTimes; ++i) {
      const int64_t begun_ns = clock.now_ns();
      if (!run()) break;
      best = std::min(best, clock.now_ns() - begun_ns);
    }
    return best;
  };
  const int64_t of_card = shortest(on_card);
  return of_card < shortest([&] { return on_cpu(), true; });
}

}  // namespace takt::cuda
