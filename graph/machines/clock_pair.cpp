// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/clock_pair.hpp"

#include <algorithm>
#include <cstdlib>

namespace takt::machines {

int64_t ClockPair::error_at(const Known& known, int64_t now_ns) {
  return known.offset.error_ns + std::abs(now_ns - known.at_ns) / 1'000'000 * kDrift_ppm;
}

void ClockPair::add(const Exchange& exchange) {
  const int64_t way_ns =
      (exchange.received_here_ns - exchange.sent_here_ns) - (exchange.sent_there_ns - exchange.received_there_ns);
  if (way_ns < 0 || exchange.received_here_ns < exchange.sent_here_ns) return;
  const int64_t there_ns = exchange.received_there_ns - exchange.sent_here_ns;
  const int64_t back_ns = exchange.sent_there_ns - exchange.received_here_ns;
  // Half of each, so that their sum does not overflow.
  const Known fresh{exchange.received_here_ns,
                    {there_ns / 2 + back_ns / 2 + (there_ns % 2 + back_ns % 2) / 2, way_ns / 2 + 1}};
  if (const auto before = offset(fresh.at_ns);
      before && std::abs(before->offset_ns - fresh.offset.offset_ns) > before->error_ns + fresh.offset.error_ns) {
    ++jumps_;
    count_ = 0;
  }
  known_[count_++ % known_.size()] = fresh;
}

std::optional<ClockPair::Offset> ClockPair::offset(int64_t now_ns) const {
  const auto end = known_.begin() + static_cast<ptrdiff_t>(std::min(count_, known_.size()));
  const auto best = std::min_element(known_.begin(), end, [now_ns](const Known& a, const Known& b) {
    return error_at(a, now_ns) < error_at(b, now_ns);
  });
  if (best == end) return std::nullopt;
  return Offset{best->offset.offset_ns, error_at(*best, now_ns)};
}

int64_t Stamps::here(int64_t there_ns, int64_t offset_ns) {
  for (size_t i = 0; i < std::min(count_, known_.size()); ++i)
    if (known_[i].there_ns == there_ns) return known_[i].here_ns;
  const int64_t here_ns = there_ns - offset_ns;
  known_[count_++ % known_.size()] = {there_ns, here_ns};
  return here_ns;
}

}  // namespace takt::machines
