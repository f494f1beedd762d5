// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/median_fusion.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "nodes/mapping_3d/fusion_kernel.hpp"

namespace takt::mapping_3d {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr size_t kRun = 1024;  // pixels: what the views saw there stays in the first cache

Point point_of(const DepthCamera& camera, size_t pixel, float depth_m) {
  const auto width = static_cast<size_t>(camera.width);
  const double scale = depth_m / camera.focal_px;
  return {static_cast<float>((static_cast<double>(pixel % width) - camera.cu_px) * scale),
          static_cast<float>((static_cast<double>(pixel / width) - camera.cv_px) * scale), depth_m};
}

size_t pixel_of(const Warped& at, const DepthCamera& camera) {
  return static_cast<size_t>(at.v) * static_cast<size_t>(camera.width) + static_cast<size_t>(at.u);
}

Warped warped(const Warp& warp, size_t pixel, float depth_m, const DepthCamera& camera) {
  return warped(warp, static_cast<int>(pixel) % camera.width, static_cast<int>(pixel) / camera.width, depth_m, camera);
}

int least_support(const FusionParameters& p, size_t views) { return std::min(p.support, static_cast<int>(views)); }

}  // namespace

MedianFusion::MedianFusion(size_t views, size_t pixels)
    : seen_(views, std::vector<float>(pixels + kFusionReadAhead, kNothing)),
      from_reference_(views),
      candidate_(kRun + kFusionReadAhead),
      row_depth_(pixels + kFusionReadAhead),
      row_seen_(pixels + kFusionReadAhead),
      row_pixel_(pixels + kFusionReadAhead),
      unsettled_(kRun + kFusionReadAhead) {}

void MedianFusion::see(const DepthView& view, const Warp& to_reference, std::span<float> seen) {
  const DepthCamera& camera = view.camera;
  std::fill(seen.begin(), seen.end(), kNothing);
  for (int v = 0; v < camera.height; ++v) {
    std::copy_n(view.depth_m.begin() + ptrdiff_t{v} * camera.width, camera.width, row_depth_.begin());
    warp_row(to_reference, v, row_depth_.data(), camera.width, camera, row_pixel_.data(), row_seen_.data());
    for (int u = 0; u < camera.width; ++u) {
      if (row_pixel_[static_cast<size_t>(u)] < 0) continue;
      float& nearest = seen[static_cast<size_t>(row_pixel_[static_cast<size_t>(u)])];
      nearest = std::min(nearest, row_seen_[static_cast<size_t>(u)]);
    }
  }
}

// Views that see the candidate or something nearer speak for it; those that look through it, against.
float MedianFusion::settled(std::span<const DepthView> views, size_t pixel, float candidate,
                            const Tolerance& tolerance) const {
  for (size_t round = 1; round < views.size() && candidate < kNothing; ++round) {
    int balance = 0;
    float next = kNothing;
    for (size_t k = 0; k < views.size(); ++k) {
      const float seen = seen_[k][pixel];
      if (seen == kNothing) continue;
      if (seen <= candidate + tolerance.at(candidate)) {
        ++balance;
        continue;
      }
      next = std::min(next, seen);
      const DepthView& view = views[k];
      const Warped at = warped(from_reference_[k], pixel, candidate, view.camera);
      if (!at.inside) continue;
      const float measured = view.depth_m[pixel_of(at, view.camera)];
      if (measured > 0 && at.depth_m < measured - tolerance.at(at.depth_m)) --balance;
    }
    if (balance >= 0) break;
    candidate = next;
  }
  return candidate;
}

void MedianFusion::fuse(std::span<const DepthView> views, size_t reference, const FusionParameters& parameters,
                        std::span<float> depth_m) {
  reference_ = reference;
  p_ = parameters;
  const DepthCamera& camera = views[reference].camera;
  const Tolerance tolerance(parameters, camera);
  std::array<const float*, kMostViews> seen{};
  for (size_t k = 0; k < views.size(); ++k) {
    from_reference_[k] = warp_between(views[reference], views[k]);
    see(views[k], warp_between(views[k], views[reference]), std::span(seen_[k]).first(camera.pixels()));
    seen[k] = seen_[k].data();
  }
  for (size_t first = 0; first < camera.pixels(); first += kRun) {
    const size_t count = std::min(kRun, camera.pixels() - first);
    const SeenRun run{seen.data(), views.size(), first, count, tolerance.per_m2, tolerance.least_m};
    if (nominate(run, candidate_.data(), unsettled_.data()))
      for (size_t i = 0; i < count; ++i)
        if (unsettled_[i] != 0) candidate_[i] = settled(views, first + i, candidate_[i], tolerance);
    conclude(run, p_.refine, least_support(p_, views.size()), candidate_.data(), row_depth_.data());
    std::copy_n(row_depth_.begin(), count, depth_m.begin() + static_cast<ptrdiff_t>(first));
  }
}

Colour MedianFusion::colour_of(std::span<const DepthView> views, size_t pixel, float depth_m) const {
  const Tolerance tolerance(p_, views[reference_].camera);
  const auto saw = [&](size_t k) { return std::abs(seen_[k][pixel] - depth_m) <= tolerance.at(depth_m); };
  size_t k = reference_;
  for (size_t other = 0; other < views.size() && !saw(k); ++other)
    if (saw(other)) k = other;
  if (k == reference_) return views[k].colour[pixel];
  const Warped at = warped(from_reference_[k], pixel, depth_m, views[k].camera);
  return at.inside ? views[k].colour[pixel_of(at, views[k].camera)] : Colour{};
}

void MedianFusion::push(std::span<const DepthView> views, std::span<const float> depth_m, double deepest_m,
                        cloud::CloudBuffer& out) const {
  const DepthView& view = views[reference_];
  const bool coloured = !view.colour.empty();
  for (size_t pixel = 0; pixel < view.camera.pixels(); ++pixel)
    if (depth_m[pixel] > 0 && depth_m[pixel] <= deepest_m)
      out.push(point_of(view.camera, pixel, depth_m[pixel]),
               coloured ? colour_of(views, pixel, depth_m[pixel]) : Colour{});
}

void MedianFusion::fuse_reference(std::span<const DepthView> views, size_t reference, const FusionParameters& p,
                                  std::span<float> depth_m) {
  const DepthView& a = views[reference];
  const size_t n = views.size(), pixels = a.camera.pixels();
  const Tolerance tolerance(p, a.camera);
  std::vector<std::vector<float>> seen(n, std::vector<float>(pixels, kNothing));
  std::vector<Warp> from_reference;
  for (size_t k = 0; k < n; ++k) {
    from_reference.push_back(warp_between(a, views[k]));
    const Warp to_reference = warp_between(views[k], a);
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
      const float depth = views[k].depth_m[pixel];
      const Warped at = warped(to_reference, pixel, depth, a.camera);
      if (depth > 0 && at.inside)
        seen[k][pixel_of(at, a.camera)] = std::min(seen[k][pixel_of(at, a.camera)], at.depth_m);
    }
  }
  for (size_t pixel = 0; pixel < pixels; ++pixel) {
    float candidate = kNothing;
    for (size_t k = 0; k < n; ++k) candidate = std::min(candidate, seen[k][pixel]);
    for (size_t round = 1; round < n && candidate < kNothing; ++round) {
      int s = 0;
      float next = kNothing;
      for (size_t k = 0; k < n; ++k) {
        if (seen[k][pixel] == kNothing) continue;
        if (seen[k][pixel] <= candidate + tolerance.at(candidate)) {
          ++s;
        } else {
          next = std::min(next, seen[k][pixel]);
          const Warped at = warped(from_reference[k], pixel, candidate, a.camera);
          const float measured = at.inside ? views[k].depth_m[pixel_of(at, a.camera)] : 0;
          if (measured > 0 && at.depth_m < measured - tolerance.at(at.depth_m)) --s;
        }
      }
      if (s < 0) candidate = next;
    }
    std::vector<float> alike;
    for (size_t k = 0; k < n && candidate < kNothing; ++k)
      if (std::abs(seen[k][pixel] - candidate) <= tolerance.at(candidate)) alike.push_back(seen[k][pixel]);
    std::sort(alike.begin(), alike.end());
    const bool enough = !alike.empty() && static_cast<int>(alike.size()) >= least_support(p, n);
    depth_m[pixel] = !enough ? 0 : p.refine ? alike[(alike.size() - 1) / 2] : candidate;
  }
}

}  // namespace takt::mapping_3d
