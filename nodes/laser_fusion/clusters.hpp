// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

struct ClusterParameters {
  double link_m = 0.5;  ///< points at most so far apart hang together
  size_t least = 10;    ///< points of a cluster that stays
};

/// Drops what hangs together with too little else (thesis Sec. 4.4.2: before a registration): flying points and leaves
/// mislead it.
class ClusterFilter {
 public:
  /// Takes the memory for clouds of up to `points` points.
  explicit ClusterFilter(size_t points);

  /// Moves the points that stay to the front, in their order; returns how many those are. Compares every point with
  /// every other: for the thinned clouds of a registration. At most as many points as there is memory for.
  size_t filter(std::span<Point> points, const ClusterParameters& parameters) {
    begin(points, parameters);
    while (!go_on()) {
    }
    return kept_;
  }
  /// The same in portions of about kPortion comparisons: the points stay where they are until go_on() says true.
  void begin(std::span<Point> points, const ClusterParameters& parameters);
  bool go_on();
  size_t kept() const { return kept_; }

  static constexpr size_t kPortion = 1 << 18;

 private:
  bool conclude();

  ClusterParameters parameters_;
  std::span<Point> points_;
  size_t grown_ = 0;  ///< points of the cluster whose neighbours are in it
  size_t kept_ = 0;
  std::vector<uint32_t> queue_;  ///< the cluster that grows
  std::vector<uint32_t> rest_;   ///< points of no cluster yet
  std::vector<uint8_t> keep_;
};

}  // namespace takt::laser_fusion
