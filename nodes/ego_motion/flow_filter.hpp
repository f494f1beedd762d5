// SPDX-License-Identifier: Apache-2.0
// Outlier removal of thesis Sec. 4.3.2, step 3: a displacement must agree with the median of its neighbourhood.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace takt::ego_motion {

struct Flow {
  float x = 0, y = 0;    ///< where the corner was, px
  float dx = 0, dy = 0;  ///< how far it moved, px
};

struct FlowFilterParameters {
  double r_min_px = 20;  ///< radius of the neighbourhood; the corner itself counts
  double t_flow_px = 2;  ///< largest Euclidean distance from the median displacement
  int n_flow = 3;        ///< fewest members of the neighbourhood
};

/// keep[i] = 1 if flow i agrees with its neighbourhood (component-wise lower median). Decides for all first. Square
/// grid of cells; scratch for `capacity` flows inside an image of the given size is taken by the constructor.
class FlowFilter {
 public:
  FlowFilter() = default;
  FlowFilter(int width, int height, size_t capacity, const FlowFilterParameters& parameters);
  /// From the next apply() on.
  void tune(const FlowFilterParameters& parameters);
  void apply(std::span<const Flow> flows, std::span<uint8_t> keep);

  /// Slow, obvious version: every flow against every other.
  static void apply_reference(std::span<const Flow> flows, const FlowFilterParameters& parameters,
                              std::span<uint8_t> keep);

 private:
  int cell_of(const Flow& flow) const;

  FlowFilterParameters p_;
  int width_ = 0, height_ = 0, edge_ = 0;  ///< of the image, and of a cell
  int columns_ = 0, rows_ = 0;
  std::vector<uint32_t> start_, order_;
  std::vector<float> dx_, dy_;
};

}  // namespace takt::ego_motion
