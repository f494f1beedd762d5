// SPDX-License-Identifier: Apache-2.0
// What evaluations and calibrations say of many values. Allocates: not for jobs.
#pragma once
#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace takt {

/// The value with `share` (0 .. 1) of the values below it, the upper of two middle ones; 0 of none.
template <class Number>
double quantile(std::vector<Number> values, double share) {
  if (values.empty()) return 0;
  const auto at = std::min(values.size() - 1, static_cast<size_t>(share * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(at), values.end());
  return static_cast<double>(values[at]);
}

template <class Number>
double median(std::vector<Number> values) {
  return quantile(std::move(values), 0.5);
}

}  // namespace takt
