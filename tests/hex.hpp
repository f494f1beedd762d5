// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace takt::test {

/// "02 80" or "0280"; nothing but hexadecimal digits and spaces.
inline std::vector<uint8_t> bytes_of_hex(std::string_view hex) {
  std::vector<uint8_t> bytes;
  bool high = true;
  for (const char digit : hex) {
    if (digit == ' ') continue;
    const int value = digit <= '9' ? digit - '0' : (digit | 32) - 'a' + 10;
    if (high) bytes.push_back(static_cast<uint8_t>(value << 4));
    else bytes.back() = static_cast<uint8_t>(bytes.back() | value);
    high = !high;
  }
  return bytes;
}

template <class Range>
std::vector<uint8_t> copy_of(const Range& bytes) {
  return {bytes.begin(), bytes.end()};
}

inline std::vector<uint8_t> operator+(std::vector<uint8_t> a, const std::vector<uint8_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace takt::test
