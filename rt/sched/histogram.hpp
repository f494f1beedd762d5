// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace takt {

/// Distribution of durations in ns, for runs of any length in 10.5 kB: 32 buckets an octave, so a quantile is at most
/// 3.1 % above the sample that it stands for. Count, sum and maximum are exact. Nothing is ever dropped: all samples
/// beyond 2^45 ns (9.8 h) are in the last bucket, whose edge is the maximum. Negative values count as 0. One writer.
/// Plain data: may lie in shared memory.
class Histogram {
 public:
  void add(int64_t ns);
  uint64_t count() const { return count_; }
  int64_t max_ns() const { return max_; }
  int64_t sum_ns() const { return sum_; }
  /// Smallest value that at least `fraction` (0..1) of the samples do not exceed; 0 without samples.
  int64_t quantile_ns(double fraction) const;
  /// Calls visit(upper edge in ns, samples) for every bucket that is not empty, in ascending order.
  template <class Visitor>
  void for_each(const Visitor& visit) const {
    for (size_t i = 0; i < buckets_.size(); ++i)
      if (buckets_[i] > 0) visit(i + 1 < kBuckets ? upper_edge(i) : max_, buckets_[i]);
  }

 private:
  static constexpr int kSubBits = 5, kMostBits = 45;
  static constexpr size_t kBuckets = (size_t{kMostBits - kSubBits + 1} << kSubBits) + 1;
  static size_t bucket_of(uint64_t value);
  static int64_t upper_edge(size_t bucket);

  std::array<uint64_t, kBuckets> buckets_{};
  uint64_t count_ = 0;
  int64_t max_ = 0, sum_ = 0;
};

}  // namespace takt
