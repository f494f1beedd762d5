// SPDX-License-Identifier: Apache-2.0
// A session that gets any bytes at any times.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hal/laser/laser_session.hpp"
#include "hal/stream/frame_search.hpp"
#include "tests/fuzz/require.hpp"

namespace takt::fuzz {

/// What a parser finds in bytes that come in pieces: kinds and places.
template <class Parser>
auto events_in(std::span<const uint8_t> bytes, size_t piece, Parser parser) {
  std::vector<std::pair<int, uint64_t>> found;
  while (!bytes.empty()) {
    const auto now = bytes.first(std::min(piece, bytes.size()));
    parse(parser, now, [&](const auto& event) { found.emplace_back(static_cast<int>(event.kind), event.position); });
    bytes = bytes.subspan(now.size());
  }
  return found;
}

/// Does what the session wants until it waits; it must come to that, and must not ask for what no line can do.
inline void obey(LaserSession& session, int64_t now_ns) {
  for (int orders = 0;; ++orders) {
    require(orders < 16);
    const LineOrder order = session.next(now_ns);
    switch (order.kind) {
      case LineOrder::Kind::wait: return require(order.until_ns > now_ns);
      case LineOrder::Kind::send: require(!order.bytes.empty() && order.gap_ns >= 0); break;
      case LineOrder::Kind::set_baud: session.line_has(order.baud); break;
      case LineOrder::Kind::reopen: session.begin(now_ns); break;
    }
  }
}

/// Of each piece of the input the first two bytes say how long it is, and when it comes after the one before.
inline void converse(LaserSession& session, std::span<const uint8_t> input) {
  constexpr int64_t kMs = 1'000'000;
  constexpr int64_t kPause_ns[] = {0, kMs / 10, kMs, 50 * kMs, 300 * kMs, 1200 * kMs, 4000 * kMs, 20'000 * kMs};
  const ScanFormat format = session.format();
  int64_t now_ns = 0;
  session.begin(now_ns);
  obey(session, now_ns);
  while (input.size() >= 2) {
    const size_t head = static_cast<size_t>(input[0] << 8 | input[1]);
    const auto piece = input.subspan(2, std::min<size_t>(input.size() - 2, head & 0x3FF));
    input = input.subspan(2 + piece.size());
    now_ns += kPause_ns[head >> 13];
    if (const ReceivedScan* scan = session.receive(piece, now_ns)) {
      require(scan->range_m.size() == format.beams);
      require(scan->stamp_ns <= now_ns);
      for (const float range : scan->range_m)
        require(range >= 0 && static_cast<double>(range) <= format.max_range_m * (1 + 1e-6));
    }
    obey(session, now_ns);
  }
}

}  // namespace takt::fuzz
