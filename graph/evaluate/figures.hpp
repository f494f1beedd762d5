// SPDX-License-Identifier: Apache-2.0
// What evaluations say of many values.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace takt::command {

/// The value with `share` (0 .. 1) of the values below it; 0 of none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = std::min(values.size() - 1, static_cast<size_t>(share * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(at), values.end());
  return values[at];
}

/// 0 of nothing.
template <class Count>
double percent(Count part, Count whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace takt::command
