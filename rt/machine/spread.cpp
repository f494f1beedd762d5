// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/spread.hpp"

#include <algorithm>
#include <cmath>

namespace takt::machine {

Spread Spread::of(std::vector<int64_t> ns) {
  Spread spread;
  spread.samples = static_cast<int64_t>(ns.size());
  if (ns.empty()) return spread;
  std::sort(ns.begin(), ns.end());
  const auto quantile_us = [&](double fraction) {
    const auto rank = static_cast<size_t>(std::ceil(fraction * static_cast<double>(ns.size())));
    return static_cast<double>(ns[std::clamp<size_t>(rank, 1, ns.size()) - 1]) / 1e3;
  };
  spread.p50_us = quantile_us(0.5);
  spread.p99_us = quantile_us(0.99);
  spread.max_us = quantile_us(1.0);
  return spread;
}

}  // namespace takt::machine
