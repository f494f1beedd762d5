// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace takt {

/// Distribution of durations in ns, for runs of any length in fixed memory: buckets 1/128 of an octave wide (figures
/// are right to 0.8 %), count and maximum exact. Nothing is ever dropped. Negative values count as 0. One writer.
class Histogram {
 public:
  Histogram() : buckets_(kBuckets) {}
  void add(int64_t ns);
  void merge(const Histogram& other);
  uint64_t count() const { return count_; }
  int64_t max_ns() const { return max_; }
  int64_t sum_ns() const { return sum_; }
  /// Smallest value that at least `fraction` (0..1) of the samples do not exceed; 0 without samples.
  int64_t quantile_ns(double fraction) const;

 private:
  static constexpr int kSubBits = 7;
  static constexpr size_t kBuckets = (48 - kSubBits + 1) << kSubBits;
  static size_t bucket_of(uint64_t value);
  static int64_t upper_edge(size_t bucket);

  std::vector<uint64_t> buckets_;
  uint64_t count_ = 0;
  int64_t max_ = 0, sum_ = 0;
};

}  // namespace takt
