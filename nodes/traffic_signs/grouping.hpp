// SPDX-License-Identifier: Apache-2.0
// Boxes that mean the same thing become one.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace takt::traffic_signs {

/// Pixels of an image: [x, x + width) x [y, y + height).
struct Box {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Common area by area of the union, 0..1.
double intersection_over_union(const Box& a, const Box& b);

struct Group {
  Box box;       ///< mean of the group's
  int hits = 0;  ///< how many there were
};

/// The groups of cv::groupRectangles with eps 0.2, without its memory: boxes whose borders differ by at most a fifth of
/// their edge are of one group, and so is what a chain of such boxes connects; groups that lie within a stronger one
/// are dropped. Memory is taken by the constructor; the rest allocates nothing.
class Grouping {
 public:
  /// For at most `most` boxes at a time.
  explicit Grouping(size_t most);

  size_t most() const { return parents_.size(); }
  /// Groups of at least `least` >= 1 boxes, in the order of their first box; valid until the next call. Boxes beyond
  /// the most are left out.
  std::span<const Group> group(std::span<const Box> boxes, int least);

 private:
  size_t root(size_t i);

  std::vector<uint32_t> parents_, index_;
  std::vector<Group> groups_, kept_;
};

}  // namespace takt::traffic_signs
