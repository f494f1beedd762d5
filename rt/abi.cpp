// SPDX-License-Identifier: Apache-2.0
#include "rt/abi.hpp"

namespace takt {
namespace {

/// The part before the first `end`, which is taken off `text` together with it.
std::string_view cut(std::string_view& text, char end) {
  const size_t length = text.find(end);
  const std::string_view part = text.substr(0, length);
  text.remove_prefix(length == std::string_view::npos ? text.size() : length + 1);
  return part;
}

}  // namespace

std::string abi_difference(std::string_view theirs, std::string_view ours) {
  std::string text;
  while (!theirs.empty() || !ours.empty()) {
    std::string_view their_value = cut(theirs, ';'), our_value = cut(ours, ';');
    if (their_value == our_value) continue;
    const std::string_view their_name = cut(their_value, '='), our_name = cut(our_value, '=');
    if (their_name != our_name) return "its ABI text has other properties: it is of another version of Takt";
    if (!text.empty()) text += "; ";
    text.append(our_name).append(" is ").append(their_value).append(", here ").append(our_value);
  }
  return text;
}

}  // namespace takt
