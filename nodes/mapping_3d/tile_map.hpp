// SPDX-License-Identifier: Apache-2.0
// A map of points that grows without redundant ones, in memory of a fixed size: one point a voxel, in tiles that are
// anchored where the robot was, so that a map whose path is corrected is laid anew tile by tile.
#pragma once
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "nodes/cloud/voxel_grid.hpp"
#include "nodes/mapping_3d/depth_view.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/state_archive.hpp"

namespace takt::mapping_3d {

struct MapParameters {
  double voxel_m = 0.05;                 ///< one point in each
  double tile_m = 3;                     ///< a tile is begun where no anchor lies so near
  size_t tiles = 24;                     ///< at most: then the one farthest from the sensor is dropped
  size_t tile_points = size_t{1} << 15;  ///< of a tile; when it is full another one is begun
};

/// One voxel's point: the mean of what was seen in it.
struct MapPoint {
  Point place{};  ///< tile frame
  Colour colour{};
  uint8_t seen = 0;     ///< views that saw it, at most kMostSeen; 0: gone
  uint8_t missing = 0;  ///< views that looked through it since
};

/// Never says that it is enough: for work that has all the time it wants.
struct Always {
  bool operator()() const { return true; }
};

/// Voxels and their points in one frame, found by a hash table with open addresses.
class Tile {
 public:
  static constexpr uint8_t kMostSeen = 8;
  Tile(size_t points, double voxel_m);

  void begin(const Transform& in_map, int64_t stamp_ns);
  void end() { used_ = loose_ = false; }
  bool used() const { return used_; }
  bool full() const { return points_.size() == points_.capacity(); }
  const Transform& in_map() const { return in_map_; }
  void lay(const Transform& in_map) { in_map_ = in_map, loose_ = true; }
  bool loose() const { return loose_; }  ///< laid anew, and not joined with the others since
  void joined() { loose_ = false; }
  int64_t stamp_ns() const { return stamp_ns_; }
  double reach_m() const { return reach_m_; }  ///< no point lies farther from the tile's origin
  double distance_m(const Transform& place) const {
    return std::hypot(in_map_.x - place.x, in_map_.y - place.y, in_map_.z - place.z);
  }

  std::span<const MapPoint> points() const { return points_; }
  std::span<MapPoint> points() { return points_; }
  /// The point in the voxel of a place of this tile, null if there is none or it is gone.
  MapPoint* at(const Point& place);
  /// Begins a point there, or one that was gone anew. False if there is no room or the place is beyond all voxels.
  bool add(const Point& place, const Colour& colour);
  /// Makes room: forgets what is gone.
  void compact();
  /// 21 B a point. Of tiles of at most 32768 points.
  void remember(StateArchive& archive);

 private:
  size_t slot_of(const cloud::VoxelIndex& voxel) const;

  cloud::VoxelSize size_;
  bool used_ = false, loose_ = false;
  Transform in_map_;
  int64_t stamp_ns_ = 0;
  double reach_m_ = 0;
  std::vector<MapPoint> points_;
  std::vector<uint32_t> table_;  ///< index of a point, plus 1; 0: empty
};

/// Memory is taken by the constructor, 32 B a point; nothing else allocates. One thread at a time.
class TileMap {
 public:
  explicit TileMap(const MapParameters& parameters);

  /// Adds what one look at the world showed, in the sensor's frame. A point in a voxel that has one moves it there by
  /// its share; else it is new. Colours as many as points, or none.
  void add(const cloud::CloudView& cloud, const Transform& sensor_in_map, int64_t stamp_ns);

  /// What the view looks through by more than `margin_m` (beside what its depth's tolerance says) has moved away: gone
  /// once more views looked through it than saw it. Beyond `range_max_m` nothing is judged. Before each tile `more` is
  /// asked; once it says no, the rest is not held against this view, and comes first with the next one: false.
  template <class More = Always>
  bool clear_seen_through(const DepthView& view, double tolerance_per_m2, double margin_m, double range_max_m,
                          const More& more = {}) {
    const SeenThrough seen{view, tolerance_per_m2, margin_m, range_max_m};
    for (size_t n = 0; n < tiles_.size(); ++n) {
      const size_t i = (first_judged_ + n) % tiles_.size();
      if (!within_reach(tiles_[i], seen)) continue;
      if (!more()) {
        first_judged_ = i;
        return false;
      }
      clear(tiles_[i], seen);
    }
    return true;
  }

  /// The robot turns out to have been at `actual` instead of `believed` at `to_ns`; at `from_ns` all was right. Tiles
  /// begun between go and turn by the share of the error that is theirs, those after by all of it (linear in time).
  void correct(int64_t from_ns, int64_t to_ns, const Transform& believed, const Transform& actual);
  /// Points of tiles laid anew that now lie in voxels of other tiles are joined with theirs, tile by tile while `more`
  /// says so. True once none is left.
  template <class More = Always>
  bool join_laid(const More& more = {}) {
    for (Tile& tile : tiles_) {
      if (!tile.loose()) continue;
      if (!more()) return false;
      join(tile);
    }
    return true;
  }

  void clear();
  /// Adds points of the map frame, as a file has them. Allocates.
  void load(const cloud::CloudView& cloud);

  /// Calls visit(place in the map, point) for each.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for_each_near({}, std::numeric_limits<double>::infinity(), visit);
  }
  /// The same for those of all tiles that may hold a point so near to a place, seen from above.
  template <class Visit>
  void for_each_near(const Transform& place, double range_m, const Visit& visit) const {
    for (const Tile& tile : tiles_) {
      if (!tile.used()) continue;
      if (std::hypot(tile.in_map().x - place.x, tile.in_map().y - place.y) > tile.reach_m() + range_m) continue;
      const Affine to_map = to_affine(tile.in_map());
      for (const MapPoint& p : tile.points())
        if (p.seen > 0) visit(transformed(to_map, p.place.x, p.place.y, p.place.z), p);
    }
  }

  size_t tiles() const;
  size_t points() const;
  size_t bytes() const;
  uint64_t dropped() const { return dropped_; }  ///< points of tiles that made room
  /// Of a map of at most kMostRemembered points: a job should not take milliseconds to save one.
  void remember(StateArchive& archive);
  static constexpr size_t kMostRemembered = 1 << 18;

 private:
  /// A tile that may hold what is being added.
  struct Near {
    Tile* tile;
    Affine from_sensor;
    double reach_m;  ///< none of its voxels lies farther from its origin
  };
  struct SeenThrough {
    const DepthView& view;
    double tolerance_per_m2, margin_m, range_max_m;
  };
  Tile& tile_for(const Transform& sensor_in_map, int64_t stamp_ns);
  void gather_near(const Transform& sensor_in_map, double range_m, const Tile* but);
  MapPoint* find_near(const Point& p, Point& place);
  void join(Tile& tile);
  static bool within_reach(const Tile& tile, const SeenThrough& seen) {
    return tile.used() && tile.distance_m(seen.view.camera_in_map) <= tile.reach_m() + seen.range_max_m;
  }
  static void clear(Tile& tile, const SeenThrough& by);

  MapParameters p_;
  std::vector<Tile> tiles_;
  std::vector<Near> near_;
  uint64_t dropped_ = 0;
  size_t first_judged_ = 0;  ///< tile that the next view is held against first
};

}  // namespace takt::mapping_3d
