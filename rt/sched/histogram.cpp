// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace takt {

size_t Histogram::bucket_of(uint64_t value) {
  constexpr uint64_t linear = uint64_t{1} << (kSubBits + 1);  // below this every value has a bucket of its own
  if (value < linear) return value;
  const int shift = static_cast<int>(std::bit_width(value)) - kSubBits - 1;
  const size_t bucket = (static_cast<size_t>(shift) << kSubBits) + (value >> shift);
  return std::min(bucket, kBuckets - 1);
}

int64_t Histogram::upper_edge(size_t bucket) {
  constexpr size_t linear = size_t{1} << (kSubBits + 1);
  if (bucket < linear) return static_cast<int64_t>(bucket);
  const size_t shift = (bucket >> kSubBits) - 1;
  const uint64_t mantissa = bucket - (shift << kSubBits);
  return static_cast<int64_t>(((mantissa + 1) << shift) - 1);
}

void Histogram::add(int64_t ns) {
  const int64_t value = std::max<int64_t>(ns, 0);
  ++buckets_[bucket_of(static_cast<uint64_t>(value))];
  ++count_;
  sum_ += value;
  max_ = std::max(max_, value);
}

int64_t Histogram::quantile_ns(double fraction) const {
  if (count_ == 0) return 0;
  const auto wanted = std::max<uint64_t>(1, static_cast<uint64_t>(std::ceil(fraction * static_cast<double>(count_))));
  uint64_t seen = 0;
  for (size_t i = 0; i + 1 < kBuckets; ++i) {
    seen += buckets_[i];
    if (seen >= wanted) return std::min(upper_edge(i), max_);
  }
  return max_;
}

}  // namespace takt
