// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "graph/view/layout_steps.hpp"

namespace takt::view {

// With the heights above subtracted the tops must only not fall: isotonic regression by pooling adjacent violators.
std::vector<double> stack(const std::vector<double>& wanted, const std::vector<double>& heights,
                          const std::vector<double>& gaps, double low, double high) {
  const size_t n = wanted.size();
  struct Pool {
    double sum = 0;
    size_t count = 0;
    double mean() const { return sum / static_cast<double>(count); }
  };
  std::vector<double> above(n, 0);
  std::vector<Pool> pools;
  for (size_t i = 0; i < n; ++i) {
    if (i > 0) above[i] = above[i - 1] + heights[i - 1] + gaps[i];
    pools.push_back({wanted[i] - above[i], 1});
    while (pools.size() > 1 && pools[pools.size() - 2].mean() > pools.back().mean()) {
      const Pool last = pools.back();
      pools.pop_back();
      pools.back().sum += last.sum;
      pools.back().count += last.count;
    }
  }
  const double most = n == 0 ? low : std::max(low, high - above[n - 1] - heights[n - 1]);
  std::vector<double> tops;
  for (const Pool& pool : pools)
    for (size_t k = 0; k < pool.count; ++k) tops.push_back(std::clamp(pool.mean(), low, most) + above[tops.size()]);
  return tops;
}

}  // namespace takt::view
