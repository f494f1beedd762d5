// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/cloud_mapper.hpp"

#include <algorithm>

namespace takt::mapping_3d {

CloudMapper::CloudMapper(const MapperParameters& parameters, size_t pixels)
    : p_(parameters),
      fusion_(p_.views, pixels),
      map_(p_.map),
      ring_(p_.views),
      depth_m_(pixels),
      points_(pixels),
      colours_(pixels) {
  for (Kept& kept : ring_) {
    kept.depth_m.resize(pixels);
    kept.colour.resize(pixels);
  }
}

void CloudMapper::tune(MapperParameters parameters) {
  parameters.views = p_.views;
  parameters.range_max_m = p_.range_max_m;
  parameters.map = p_.map;
  p_ = parameters;
}

DepthView CloudMapper::Kept::view() {
  return {camera, camera_in_map, std::span(depth_m).first(camera.pixels()),
          std::span(colour).first(coloured ? camera.pixels() : 0)};
}

void CloudMapper::Kept::remember(StateArchive& archive) {
  TAKT_STATE(archive, camera, camera_in_map, stamp_ns, coloured);
  const size_t pixels = camera.pixels();
  if (pixels > depth_m.size()) return archive.fail();
  archive.raw(depth_m.data(), pixels * sizeof(float));
  if (coloured) archive.raw(colour.data(), pixels * sizeof(Colour));
}

void CloudMapper::remember(StateArchive& archive) {
  TAKT_STATE(archive, newest_, views_, map_);
  if (newest_ >= ring_.size() || views_ > ring_.size()) return archive.fail();
  archive.room(ring_.size() * (sizeof(Kept) + depth_m_.size() * (sizeof(float) + sizeof(Colour))));
  for (size_t age = 0; age < views_; ++age) archive(ring_[(newest_ + ring_.size() - age) % ring_.size()]);
}

void CloudMapper::add_view(const cloud::CloudView& cloud, const DepthCamera& camera, const Transform& camera_in_map,
                           int64_t stamp_ns) {
  if (views_ > 0 && (ring_[newest_].camera != camera || ring_[newest_].coloured != cloud.coloured())) views_ = 0;
  newest_ = (newest_ + 1) % ring_.size();
  views_ = std::min(views_ + 1, ring_.size());
  Kept& kept = ring_[newest_];
  kept.camera = camera;
  kept.camera_in_map = camera_in_map;
  kept.stamp_ns = stamp_ns;
  kept.coloured = cloud.coloured();
  DepthView drawn = kept.view();
  draw(cloud.points, cloud.colours, drawn);

  std::array<DepthView, MedianFusion::kMostViews> views;
  for (size_t i = 0; i < views_; ++i)  // oldest first
    views[i] = ring_[(newest_ + ring_.size() - (views_ - 1) + i) % ring_.size()].view();
  const size_t middle = views_ / 2;
  const std::span<const DepthView> window = std::span(views).first(views_);
  const std::span<float> depth_m = std::span(depth_m_).first(camera.pixels());
  fusion_.fuse(window, middle, p_.fusion, depth_m);
  unjudged_ = DepthView{camera, window[middle].camera_in_map, depth_m, {}};
  cloud::CloudBuffer out(points_, cloud.coloured() ? std::span(colours_) : std::span<Colour>());
  fusion_.push(window, depth_m, p_.range_max_m, out);
  fused_ = {out.view(), unjudged_->camera_in_map,
            ring_[(newest_ + ring_.size() - (views_ - 1) + middle) % ring_.size()].stamp_ns};
  map_.add(fused_.cloud, fused_.camera_in_map, fused_.stamp_ns);
}

}  // namespace takt::mapping_3d
