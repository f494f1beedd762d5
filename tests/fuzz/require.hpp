// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace takt::fuzz {

inline void require(bool holds) {
  if (!holds) __builtin_trap();
}

}  // namespace takt::fuzz
