// SPDX-License-Identifier: Apache-2.0
// Internal: the byte planes of an image that a cost compares.
#pragma once
#include <array>

#include "nodes/stereo/aligned_rows.hpp"
#include "nodes/stereo/parameters.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

constexpr int kMaxPlanes = 6;

/// Planes of a cost that the vector kernels know: both derivatives, the channels, or the census bits.
constexpr int planes_of(CostKind kind) {
  return kind == CostKind::gradient ? 2 : kind == CostKind::census ? kCensusBits / 8 : 3;
}

using Planes = std::array<Rows<uint8_t>, kMaxPlanes>;

class PlaneMaker {
 public:
  /// For the costs gradient, ssd, sad and census.
  PlaneMaker(int width, int height, int channels, CostKind cost);

  /// Memory for the planes of one image; `depth` more elements may be read behind each row.
  Planes planes(int depth) const;
  /// The planes of an image of that size, in reading order or with the columns reversed.
  void make(ImageView<const uint8_t> image, bool mirror, Planes& out);
  int count() const { return planes_of(cost_); }

 private:
  void make_grey(ImageView<const uint8_t> image);
  void make_row(ImageView<const uint8_t> image, int plane, int y, uint8_t* out) const;
  bool on_grey() const { return cost_ == CostKind::gradient || cost_ == CostKind::census; }

  int width_, height_, channels_;
  CostKind cost_;
  const ImageKernels* kernels_;
  Rows<uint8_t> grey_;
  Buffer<uint8_t> scratch_;
};

}  // namespace takt::stereo
