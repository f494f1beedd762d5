// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <random>

#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

/// Draws from a seeded engine: whole numbers with both ends, real ones without the upper.
struct Random {
  std::mt19937 engine;
  Ticks uniform(Ticks low, Ticks high) { return std::uniform_int_distribution<Ticks>(low, high)(engine); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
};

}  // namespace takt::analysis
