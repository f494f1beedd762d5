// SPDX-License-Identifier: Apache-2.0
// From seeds to objects: regions, merged where several seeds lie on one object.
#pragma once
#include <span>
#include <vector>

#include "nodes/object_3d/region_growing.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

struct SegmentParameters {
  GrowParameters grow{.d_max_m = 0.02f};
  Reach reach{0.4f, 0.35f, 0.6f};
  size_t points_min = 60;
  double overlap = 0.5;  ///< share of the smaller of two regions above which they are one object; 0..1
};

/// One object: its points and where it was seeded.
struct Segment {
  uint32_t seed = 0;
  size_t first = 0, last = 0;  ///< of Segmenter::points_of
};

/// Seeds from the highest to the lowest (of equals the first in the cloud). A seed that lies in a region already is
/// passed over. A region that shares more than `overlap` of the smaller of the two with an earlier one is that object
/// once more, as a face and a hand are one person; else its points that no earlier region has are a new object. A
/// region cut off by its reach is part of something larger, and one with fewer than points_min is noise: no objects,
/// and no seeds for others. Memory is taken by the constructor; nothing else allocates.
class Segmenter {
 public:
  /// For clouds of up to `capacity` points and so many objects: about 70 B a point.
  Segmenter(size_t capacity, size_t most_segments);

  /// As RegionGrower::fill; then, with all indices of the cloud, or some, as seeds (which are put in order):
  void begin(std::span<const Point> points, std::span<const Colour> colours, std::span<uint32_t> seeds,
             const SegmentParameters& parameters);
  /// Does a portion of the work, about a tenth of a millisecond. False once all seeds are done. Whoever stops before
  /// has the objects complete so far.
  bool advance();
  /// Share of the seeds that were looked at, 0..1.
  double done() const;

  std::span<const Segment> segments() const { return std::span(segments_).first(count_); }
  std::span<uint32_t> points_of(const Segment& segment) {
    return std::span(members_).subspan(segment.first, segment.last - segment.first);
  }

 private:
  void finish_region();

  static constexpr size_t kPortion = 512;
  static constexpr uint32_t kFree = UINT32_MAX, kNoObject = UINT32_MAX - 1;
  SegmentParameters parameters_;
  RegionGrower grower_;
  std::span<const uint32_t> seeds_;
  size_t next_seed_ = 0;
  bool growing_ = false;
  std::vector<uint32_t> owner_;  ///< of each point: a segment, kFree or kNoObject
  std::vector<Segment> segments_;
  std::vector<size_t> shared_;  ///< points of the region under way that each segment has
  std::vector<uint32_t> members_;
  size_t count_ = 0, member_count_ = 0;
};

/// The same by grow_reference: the points of each object.
std::vector<std::vector<uint32_t>> segment_reference(std::span<const Point> points, std::span<const Colour> colours,
                                                     std::vector<uint32_t> seeds, const SegmentParameters& parameters);

}  // namespace takt::object_3d
