// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "tests/nanoseconds.hpp"

namespace takt::test {

/// When runs in virtual time begin.
inline constexpr int64_t kEpoch = 1'000 * kMs;

}  // namespace takt::test
