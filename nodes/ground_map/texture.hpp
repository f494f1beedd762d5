// SPDX-License-Identifier: Apache-2.0
// The texture of the floor before the robot: reference area, descriptor of one frame, memory of many (thesis
// Sec. 4.2.1; R-7.1 - R-7.4).
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nodes/ground_map/floor_projection.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::ground_map {

/// Trapezoid at the bottom centre of the image, as shares of its width and height.
struct TrapezoidShares {
  double bottom = 0.5, top = 0.3;  ///< of the width
  double height = 0.2;             ///< of the height
  double skip = 0.02;              ///< of the height: lowest rows left out
};

/// The pixels of the trapezoid. Allocates in the constructor only.
class ReferenceArea {
 public:
  ReferenceArea(int width, int height, const TrapezoidShares& shares);
  /// Another area of the same image.
  void tune(const TrapezoidShares& shares);
  std::span<const RowSpan> spans() const { return spans_; }
  int64_t pixels() const { return pixels_; }
  /// Whether a point of the image (px, pixel centres at whole numbers) lies in the area.
  bool contains(double x_px, double y_px) const;

 private:
  int width_, height_;
  std::vector<RowSpan> spans_;  ///< one per row, downwards without a gap
  int64_t pixels_ = 0;
};

/// Pixels of the reference area for which t_m is meant: that of a 640 x 480 image (C-7).
constexpr int64_t kDefaultAreaPx = 24576;

/// Inclusive ranges of saturation and value.
struct Descriptor {
  uint8_t s_min, s_max, v_min, v_max;
  bool contains(uint8_t s, uint8_t v) const { return s >= s_min && s <= s_max && v >= v_min && v <= v_max; }
  bool operator==(const Descriptor&) const = default;
};

/// Lowest and highest bin of the two marginal histograms over the area that hold at least t_m pixels, t_m scaled
/// with the size of the area. None where no bin of one of them does.
std::optional<Descriptor> describe(ImageView<const uint8_t> saturation, ImageView<const uint8_t> value,
                                   const ReferenceArea& area, double t_m);

/// Ring buffer of the newest `capacity` descriptors with weights falling from 1 to 1 / capacity (thesis Eq. 4.3 with
/// E-19), and for every (saturation, value) whether the sum of the weights of the descriptors that hold it is above
/// t_w. Integers throughout. Allocates in the constructor only.
class TextureMemory {
 public:
  /// capacity in 1..10000, t_w > 0.
  TextureMemory(int capacity, double t_w);
  /// Another t_w for what is remembered.
  void tune(double t_w);
  void add(const Descriptor& descriptor);
  int size() const { return filled_; }

  /// N_b - a_k of entry k of the ring: capacity for the newest, one less for each step of age; 0 if not filled.
  int weight(int k) const;
  const Descriptor& entry(int k) const { return ring_[static_cast<size_t>(k)]; }
  /// The i-th oldest, i < size().
  const Descriptor& by_age(int i) const {
    const int capacity = static_cast<int>(ring_.size());
    return entry((newest_ + 1 - filled_ + i + capacity) % capacity);
  }
  /// Sum of those weights over the entries that hold (s, v).
  int32_t sum(uint8_t s, uint8_t v) const { return sums_[(size_t{v} + 1) * kStride + s + 1]; }
  /// Table of 256 x 256 bytes, index 256 v + s: 1 ground, 0 not.
  const uint8_t* table() const { return table_.data(); }
  /// The sum must be above this.
  int32_t limit() const { return limit_; }
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, ring_, newest_, filled_);
    if (!archive.loads() || archive.failed()) return;
    const int capacity = static_cast<int>(ring_.size());
    if (newest_ < -1 || newest_ >= capacity || filled_ < 0 || filled_ > capacity) archive.fail();
    else rebuild();
  }

 private:
  static constexpr size_t kStride = 258;  ///< a border before, so that the prefix sum needs no case, and one behind
  void rebuild();

  std::vector<Descriptor> ring_;
  int newest_ = -1, filled_ = 0;
  int32_t limit_ = 0;
  std::vector<int32_t> sums_;
  std::vector<uint8_t> table_;
};

}  // namespace takt::ground_map
