// SPDX-License-Identifier: Apache-2.0
// Frames of an LMS 400 as texts and bytes.
#pragma once
#include <algorithm>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/laser/lms400/frame.hpp"
#include "hal/laser/lms400/messages.hpp"
#include "tests/hex.hpp"

namespace takt::test {

using namespace lms400;
using Texts = std::vector<std::string>;

inline std::span<const uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}
inline std::string text_of(std::span<const uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

/// "sMA", "sAN ok", "m20 x5", "error".
inline std::string text_of(const Event& event) {
  if (event.kind != EventKind::frame) return "error";
  if (const auto m = read_measurement(event.payload)) {
    char text[32];
    std::snprintf(text, sizeof text, "m%X x%zu", static_cast<unsigned>(m->format), m->count());
    return text;
  }
  const auto answer = read_answer(event.payload);
  if (!answer) return "other";
  return answer->kind == Kind::accepted ? "sMA" : read_hex(answer->word(0)) == 0u ? "sAN ok" : "sAN";
}

inline Texts events_in(std::span<const uint8_t> bytes, size_t piece = SIZE_MAX) {
  Parser parser;
  Texts events;
  while (!bytes.empty()) {
    const auto now = bytes.first(std::min(piece, bytes.size()));
    parse(parser, now, [&](const Event& event) { events.push_back(text_of(event)); });
    bytes = bytes.subspan(now.size());
  }
  return events;
}

inline std::vector<uint8_t> payload_of(std::span<const uint8_t> frame) {
  Parser parser;
  std::vector<uint8_t> payload;
  parse(parser, frame, [&](const Event& event) { payload = copy_of(event.payload); });
  return payload;
}

inline std::vector<uint8_t> written(const Measurement& m) {
  std::vector<uint8_t> payload(kLargestPayload);
  payload.resize(write_measurement(m, payload));
  return copy_of(Frame(payload).bytes());
}

/// Of the golden streams, in their order.
inline const Texts kStreamEvents[] = {
    {"sMA", "sAN ok", "m20 x5"}, {"sMA", "m20 x5", "sAN ok"}, {"error", "m20 x5"}, {"m20 x5"}, {"error", "m20 x5"}};

}  // namespace takt::test
