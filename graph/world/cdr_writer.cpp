// SPDX-License-Identifier: Apache-2.0
#include "graph/world/cdr_writer.hpp"

#include <algorithm>
#include <bit>

namespace takt::world {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

CdrWriter::CdrWriter(std::span<std::byte> to) : to_(to) {
  constexpr std::byte header[kHeaderBytes]{std::byte{0}, std::byte{1}, std::byte{0},
                                           std::byte{0}};  // CDR_LE, no options
  numbers(header, kHeaderBytes, 1);
}

std::byte* CdrWriter::take(size_t elements, size_t bytes_each) {
  if (elements == 0) return nullptr;  // nor is what does not follow aligned
  const size_t padding = at_ < kHeaderBytes ? 0 : (bytes_each - (at_ - kHeaderBytes) % bytes_each) % bytes_each;
  const size_t from = at_ + padding, end = from + elements * bytes_each;
  const bool fits = !refused_ && at_ <= to_.size() && end <= to_.size();
  if (fits) std::fill_n(to_.begin() + static_cast<ptrdiff_t>(at_), padding, std::byte{0});
  at_ = end;
  return fits ? to_.data() + from : nullptr;
}

void CdrWriter::numbers(const void* from, size_t elements, size_t bytes_each) {
  if (std::byte* at = take(elements, bytes_each)) std::memcpy(at, from, elements * bytes_each);
}

void CdrWriter::count(size_t elements) {
  refused_ = refused_ || elements > UINT32_MAX;
  number(static_cast<uint32_t>(elements));
}

void CdrWriter::text(std::string_view text) {
  text = text.substr(0, text.find('\0'));
  count(text.size() + 1);
  numbers(text.data(), text.size(), 1);
  number('\0');
}

}  // namespace takt::world
