// SPDX-License-Identifier: Apache-2.0
// The kernel's trace buffer as it comes out of trace_pipe_raw. Layout: Documentation/trace/ring-buffer-map.rst and the
// files events/header_page, events/header_event of tracefs; field offsets of an event: its file `format`.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace takt::trace {

/// Where a field of a record lies.
struct Field {
  size_t offset = 0, size = 0;
};
/// The field of that name in the text of a `format` or `header_page` file; nothing if it has none.
std::optional<Field> find_field(std::string_view format, std::string_view name);
/// The number after "ID:" in a `format` file.
std::optional<uint16_t> find_id(std::string_view format);

/// A field as a signed number; 0 if the record is too short.
int64_t read_field(std::span<const std::byte> record, Field field);
/// A field of characters, up to its end or the first 0.
std::string_view read_text(std::span<const std::byte> record, Field field);

/// Walks through one page: `take(int64_t at_ns, std::span<const std::byte> record)` for each record. Returns how many
/// records the kernel says it dropped before this page (at least 1 if it dropped any). A page that is cut off or
/// damaged ends the walk early; nothing outside of it is read.
template <class Take>
uint64_t for_each_record(std::span<const std::byte> page, size_t data_offset, Take&& take);

// How a record begins: 5 bits of type or length, 27 bits of time since the last record.
namespace ftrace {
inline constexpr uint32_t kLongestShort = 28, kPadding = 29, kTimeExtend = 30, kTimeStamp = 31;
inline constexpr uint64_t kCommitMask = (1U << 27U) - 1, kMissed = 1U << 31U, kMissedStored = 1U << 30U;

inline uint32_t word(std::span<const std::byte> page, size_t at) {
  uint32_t value = 0;
  std::memcpy(&value, page.data() + at, sizeof value);
  return value;
}
inline uint64_t long_word(std::span<const std::byte> page, size_t at) {
  uint64_t value = 0;
  std::memcpy(&value, page.data() + at, sizeof value);
  return value;
}
}  // namespace ftrace

template <class Take>
uint64_t for_each_record(std::span<const std::byte> page, size_t data_offset, Take&& take) {
  if (page.size() < data_offset || data_offset < 16) return 0;
  uint64_t now = ftrace::long_word(page, 0);
  const uint64_t commit = ftrace::long_word(page, 8);
  const size_t end = std::min<size_t>(page.size(), data_offset + (commit & ftrace::kCommitMask));
  for (size_t at = data_offset; at + 4 <= end;) {
    const uint32_t head = ftrace::word(page, at), type = head & 31U, delta = head >> 5U;
    at += 4;
    if (type == ftrace::kPadding) {
      if (delta == 0 || at + 4 > end) break;  // the rest of the page is empty
      now += delta;
      at += ftrace::word(page, at);
    } else if (type == ftrace::kTimeExtend || type == ftrace::kTimeStamp) {
      if (at + 4 > end) break;
      const uint64_t high = uint64_t{ftrace::word(page, at)} << 27U;
      // An absolute stamp has 59 bits; the others are those of the time so far.
      now = type == ftrace::kTimeExtend ? now + (high | delta) : (now & ~((uint64_t{1} << 59U) - 1)) | high | delta;
      at += 4;
    } else {
      now += delta;
      size_t length = size_t{type} * 4;
      if (type == 0) {
        if (at + 4 > end) break;
        length = ftrace::word(page, at);  // counts itself
        if (length < 4) break;
        length -= 4, at += 4;
      }
      if (at + length > end) break;
      take(static_cast<int64_t>(now), page.subspan(at, length));
      at += (length + 3) / 4 * 4;
    }
  }
  if ((commit & ftrace::kMissed) == 0) return 0;
  const bool told = (commit & ftrace::kMissedStored) != 0 && end + 8 <= page.size();
  return told ? ftrace::long_word(page, end) : 1;
}

}  // namespace takt::trace
