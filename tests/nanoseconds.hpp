// SPDX-License-Identifier: Apache-2.0
// Lengths of time in ns.
#pragma once
#include <cstdint>

namespace takt::test {

inline constexpr int64_t kUs = 1'000, kMs = 1'000'000, kSecond = 1'000'000'000;

}  // namespace takt::test
