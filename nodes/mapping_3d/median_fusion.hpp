// SPDX-License-Identifier: Apache-2.0
// One depth image from several views (thesis Alg. 4.1 as repaired in, E-26, and C-3): of each
// pixel the nearest depth that other views contradict no more often than they see something there or nearer.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/cloud/cloud.hpp"
#include "nodes/mapping_3d/depth_view.hpp"
#include "rt/msg/point.hpp"

namespace takt::mapping_3d {

struct FusionParameters {
  double steps = 1;       ///< depths are alike within so many disparity steps (Z^2 / (f B)) ...
  double least_m = 0.01;  ///< ... and within this
  bool refine = true;     ///< at the end the median of the depths alike (C-3): without, the result lies too near
  int support = 2;        ///< a depth that fewer views saw is dropped; with as few views: all of them
};

/// How far apart two depths may be and yet be alike.
class Tolerance {
 public:
  Tolerance(const FusionParameters& p, const DepthCamera& camera)
      : per_m2(static_cast<float>(p.steps * camera.step_per_m)), least_m(static_cast<float>(p.least_m)) {}
  float at(float depth_m) const { return std::max(least_m, per_m2 * (depth_m * depth_m)); }
  float per_m2, least_m;
};

/// Memory is taken by the constructor: 4 B a pixel and view, and as much again for one. One thread at a time.
class MedianFusion {
 public:
  static constexpr size_t kMostViews = 16;
  MedianFusion() = default;
  /// For up to so many views (1..kMostViews) of up to so many pixels.
  MedianFusion(size_t views, size_t pixels);

  /// `depth_m` as views[reference] would see it without noise, 0 where nothing is known. All views are of one camera.
  void fuse(std::span<const DepthView> views, size_t reference, const FusionParameters& parameters,
            std::span<float> depth_m);
  /// After fuse(), of what it gave: the points in the reference view's frame that lie no deeper. Their colours are
  /// those of the reference view where it saw that depth, else of the first view that did.
  void push(std::span<const DepthView> views, std::span<const float> depth_m, double deepest_m,
            cloud::CloudBuffer& out) const;

  /// The algorithm as it stands in the reference, pixel by pixel and view by view.
  static void fuse_reference(std::span<const DepthView> views, size_t reference, const FusionParameters& parameters,
                             std::span<float> depth_m);

 private:
  void see(const DepthView& view, const Warp& to_reference, std::span<float> seen);
  float settled(std::span<const DepthView> views, size_t pixel, float candidate, const Tolerance& tolerance) const;
  Colour colour_of(std::span<const DepthView> views, size_t pixel, float depth_m) const;

  std::vector<std::vector<float>> seen_;  ///< of each view, in the reference; infinite where it saw nothing
  std::vector<Warp> from_reference_;
  std::vector<float> candidate_, row_depth_, row_seen_;
  std::vector<int32_t> row_pixel_, unsettled_;
  size_t reference_ = 0;
  FusionParameters p_;
};

}  // namespace takt::mapping_3d
