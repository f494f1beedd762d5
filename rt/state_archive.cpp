// SPDX-License-Identifier: Apache-2.0
#include "rt/state_archive.hpp"

#include <cstdio>

namespace takt {

std::string_view StateArchive::next_name(std::string_view& names) {
  const size_t comma = std::min(names.find(','), names.size());
  std::string_view name = names.substr(0, comma);
  names.remove_prefix(std::min(comma + 1, names.size()));
  while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
  return name;
}

void StateArchive::move(void* data, size_t size) {
  if (failed_) return;
  if (way_ == Way::save) {
    if (size > to_.size()) return fail();
    if (size > 0) std::memcpy(to_.data(), data, size);
    to_ = to_.subspan(size);
  } else if (way_ == Way::load) {
    if (size > from_.size()) return fail();
    if (size > 0) std::memcpy(data, from_.data(), size);
    from_ = from_.subspan(size);
  }
  bytes_ += size;
}

size_t StateArchive::count(size_t size, size_t least) {
  uint64_t all = size;
  note(sizeof all);
  move(&all, sizeof all);
  if (way_ == Way::tell) tell(std::to_string(all) + " elements");
  if (loads() && all > from_.size() / least) fail();
  return static_cast<size_t>(all);
}

void StateArchive::move_size(Size& size) {
  note(sizeof size);
  move(&size, sizeof size);
  const bool sane = size[0] >= 0 && size[1] >= 0 && (size[1] == 0 || size[0] <= PTRDIFF_MAX / 16 / size[1]);
  if (loads() && (!sane || static_cast<size_t>(size[0] * size[1]) > from_.size())) fail();
}

void StateArchive::tell(const std::string& value) {
  if (tell_) tell_(path_, value);
}

void StateArchive::tell_bytes(const void* data, size_t size) {
  constexpr size_t kShown = 24;
  std::string text = std::to_string(size) + " bytes:";
  for (size_t i = 0; i < std::min(size, kShown); ++i) {
    char hex[4];
    std::snprintf(hex, sizeof hex, " %02x", std::to_integer<unsigned>(static_cast<const std::byte*>(data)[i]));
    text += hex;
  }
  tell(size > kShown ? text + " ..." : text);
}

}  // namespace takt
