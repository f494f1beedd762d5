// SPDX-License-Identifier: Apache-2.0
// Points sorted by the cells of a grid: what lies together in space lies together in memory.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/cloud/cloud.hpp"
#include "rt/msg/point.hpp"

namespace takt::cloud {

/// A point and where in its cloud it came from.
struct SortedPoint {
  float x, y, z;
  uint32_t index;
};

/// Cell (x, y, z) belongs to bucket (x + y row + z layer) mod buckets. Cells of a small scene each have their own; in a
/// vast one several may share one, which costs time but no exactness.
struct CellLayout {
  uint32_t row = 1, layer = 1, buckets = 1;
  bool wraps = false;  ///< buckets is a power of two, and the last is followed by the first

  uint32_t bucket(uint32_t x, uint32_t y, uint32_t z) const { return wrapped(x + y * row + z * layer); }
  uint32_t wrapped(uint32_t bucket) const { return wraps ? bucket & (buckets - 1) : bucket; }
};

class CellSort {
 public:
  /// So many sorted points past the last may be read.
  static constexpr size_t kReadAhead = 32;

  /// Takes the memory for clouds of up to `capacity` points: 28 to 36 B a point, and 1 MB at least. sort() allocates
  /// nothing.
  explicit CellSort(size_t capacity);

  /// For so many cells along each axis, which may be more than fit a number, and about so many buckets at most. Rows of
  /// cells are at least six buckets apart, also where the layout wraps.
  CellLayout layout(const double (&cells)[3], size_t most_buckets) const;

  /// Sorts by bucket_of(point), which lies below layout.buckets, or is that number: such points come last and belong to
  /// no bucket. Points of a bucket stay in the order of the cloud. At most capacity() points.
  template <class BucketOf>
  void sort(std::span<const Point> points, const CellLayout& layout, const BucketOf& bucket_of) {
    clear(layout);
    for (size_t i = 0; i < points.size(); ++i) ++start_[bucket_[i] = bucket_of(points[i])];
    scatter(points, layout);
  }

  size_t capacity() const { return bucket_.size(); }
  const SortedPoint* points() const { return sorted_.data(); }
  /// Of bucket 0 .. buckets: start()[b] .. start()[b + 1] - 1 are the points of bucket b.
  std::span<uint32_t> start() { return start_; }
  std::span<const uint32_t> start() const { return start_; }

 private:
  void clear(const CellLayout& layout);
  void scatter(std::span<const Point> points, const CellLayout& layout);

  std::vector<SortedPoint> sorted_;
  std::vector<uint32_t> bucket_, start_;
};

}  // namespace takt::cloud
