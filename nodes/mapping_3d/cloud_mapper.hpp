// SPDX-License-Identifier: Apache-2.0
// From posed clouds to a map: of a stereo camera the last few are fused into one, whose points the map takes; sweeps of
// a laser it takes as they are.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "nodes/mapping_3d/median_fusion.hpp"
#include "nodes/mapping_3d/tile_map.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/state_archive.hpp"

namespace takt::mapping_3d {

struct MapperParameters {
  size_t views = 5;        ///< clouds that are fused, 1..MedianFusion::kMostViews
  double range_max_m = 6;  ///< points that lie deeper are not mapped
  bool clear = true;       ///< what later views look through goes (TileMap::clear_seen_through)
  double clear_margin_m = 0.2;
  FusionParameters fusion;
  MapParameters map;
};

/// What one job gave to the map.
struct FusedCloud {
  cloud::CloudView cloud;  ///< camera frame
  Transform camera_in_map;
  int64_t stamp_ns = 0;
};

/// Memory is taken by the constructor: 7 B a pixel and view for the window, that of MedianFusion and TileMap, 19 B a
/// pixel beside. One thread at a time.
class CloudMapper {
 public:
  CloudMapper(const MapperParameters& parameters, size_t pixels);
  /// From the next view on; views, range_max_m and the map's own parameters stay as they were.
  void tune(MapperParameters parameters);

  /// The newest view: it is kept, the oldest of a full window goes, and the view in the middle, which others have seen
  /// from both sides, is fused from all and added to the map. How long that takes depends on the view alone.
  void add_view(const cloud::CloudView& cloud, const DepthCamera& camera, const Transform& camera_in_map,
                int64_t stamp_ns);
  void add_sweep(const cloud::CloudView& cloud, const Transform& sensor_in_map, int64_t stamp_ns) {
    map_.add(cloud, sensor_in_map, stamp_ns);
  }

  /// What a map needs beside, and what takes the longer the more there is of it: tiles that a correction has laid anew
  /// are joined, and what the last fused view looks through goes. Tile by tile while `more` says so; true once all is
  /// done. What is left of the joining goes on with the next call, what is left of the looking through goes with the
  /// view.
  template <class More = Always>
  bool tidy(const More& more = {}) {
    if (!map_.join_laid(more)) return false;
    if (!p_.clear || !unjudged_) return true;
    const DepthView view = *std::exchange(unjudged_, std::nullopt);
    return map_.clear_seen_through(view, p_.fusion.steps * view.camera.step_per_m, p_.clear_margin_m, p_.range_max_m,
                                   more);
  }

  /// Of the last add_view(), valid until the next one.
  const FusedCloud& fused() const { return fused_; }
  const TileMap& map() const { return map_; }
  /// As TileMap::correct; the window, whose poses are those before, begins anew.
  void correct(int64_t from_ns, int64_t to_ns, const Transform& believed, const Transform& actual) {
    map_.correct(from_ns, to_ns, believed, actual);
    views_ = 0;
    unjudged_.reset();
  }
  /// Points of the map frame to begin with. Allocates.
  void load(const cloud::CloudView& cloud) { map_.load(cloud); }
  /// After the map frame has changed.
  void forget() {
    map_.clear();
    views_ = 0;
    unjudged_.reset();
  }
  /// The views that there are, 7 B a pixel each, and the map. What is fused is not in it: the next view makes it anew.
  void remember(StateArchive& archive);

 private:
  struct Kept {
    DepthCamera camera;
    Transform camera_in_map;
    int64_t stamp_ns = 0;
    std::vector<float> depth_m;
    std::vector<Colour> colour;
    bool coloured = false;

    DepthView view();
    void remember(StateArchive& archive);
  };

  MapperParameters p_;
  MedianFusion fusion_;
  TileMap map_;
  std::vector<Kept> ring_;
  size_t newest_ = 0, views_ = 0;
  std::vector<float> depth_m_;
  std::vector<Point> points_;
  std::vector<Colour> colours_;
  FusedCloud fused_;
  std::optional<DepthView> unjudged_;  ///< fused, and the map not yet held against it
};

}  // namespace takt::mapping_3d
