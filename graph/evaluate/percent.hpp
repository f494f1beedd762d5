// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace takt::command {

/// 0 of nothing.
template <class Count>
double percent(Count part, Count whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace takt::command
