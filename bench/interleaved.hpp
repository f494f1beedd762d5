// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "bench/statistics.hpp"
#include "rt/time/clock.hpp"

namespace takt::bench {

/// CPU time of this thread that the work takes.
template <class Work>
double cpu_ms(const Work& work) {
  const int64_t begin = thread_cpu_ns();
  work();
  return static_cast<double>(thread_cpu_ns() - begin) * 1e-6;
}

/// Figures of rounds A B A B ... A.
struct Compared {
  Pairs pairs;
  Samples changed, cost;  ///< B, and by how much each B exceeds the mean of its two neighbours
};

template <class Plain, class Changed>
Compared compare(size_t rounds, Plain plain, Changed changed) {
  Compared out;
  double before = plain();
  out.pairs.add_a(before);
  for (size_t i = 0; i < rounds; ++i) {
    const double on = changed();
    const double after = plain();
    out.pairs.add_b(on);
    out.pairs.add_a(after);
    out.changed.add(on);
    out.cost.add(on - (before + after) / 2);
    before = after;
  }
  return out;
}

}  // namespace takt::bench
