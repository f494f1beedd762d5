// SPDX-License-Identifier: Apache-2.0
#include "hal/settings/failures.hpp"

#include <cmath>

#include "hal/settings/units.hpp"

namespace takt {
namespace {

std::optional<int64_t> instant_of(std::string_view text) {
  const auto seconds = parse_quantity(text, Dimension::time);
  if (!seconds || *seconds < 0 || *seconds > 4e9) return std::nullopt;
  return std::llround(*seconds * 1e9);
}

}  // namespace

tl::expected<std::vector<FailureWindow>, std::string> parse_failures(std::string_view text,
                                                                     std::span<const Misbehaviour> known) {
  std::vector<FailureWindow> windows;
  while (!trim(text).empty()) {
    const size_t comma = std::min(text.find(','), text.size());
    const std::string_view entry = trim(text.substr(0, comma));
    text.remove_prefix(std::min(comma + 1, text.size()));
    const auto wrong = [&](const char* what) {
      return tl::make_unexpected("`" + std::string(entry) + "` " + what + "; wanted: one of " + names_of(known) +
                                 " with its window, such as `unplugged 2s..4s, frozen 6s..6.5s`");
    };
    const size_t space = entry.find(' '), dots = entry.find("..");
    const auto failure = misbehaviour_of(entry.substr(0, space), known);
    if (!failure) return wrong("names no failure");
    if (space == std::string_view::npos || dots == std::string_view::npos || dots < space)
      return wrong("has no window");
    const auto from = instant_of(entry.substr(space, dots - space)), to = instant_of(entry.substr(dots + 2));
    if (!from || !to || *from >= *to) return wrong("has no window of two times, the second later");
    windows.push_back({*failure, *from, *to});
  }
  return windows;
}

}  // namespace takt
