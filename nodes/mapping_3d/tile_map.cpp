// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/tile_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "rt/transform/pose_math.hpp"

namespace takt::mapping_3d {
namespace {

Point point(const Position& p) {
  return {static_cast<float>(p.x_m), static_cast<float>(p.y_m), static_cast<float>(p.z_m)};
}

Position placed(const Affine& a, const Point& p) { return transformed(a, p.x, p.y, p.z); }

Transform seen_from(const Transform& frame, const Transform& child) {
  return compose(inverse({frame, {}}), {child, {}}).transform;
}

/// Moves the point to the mean of what was seen.
void merge(const Point& place, const Colour& colour, MapPoint& into) {
  const float share = 1.0f / static_cast<float>(into.seen + 1);
  into.place.x += (place.x - into.place.x) * share;
  into.place.y += (place.y - into.place.y) * share;
  into.place.z += (place.z - into.place.z) * share;
  const auto mixed = [&](uint8_t was, uint8_t is) {
    return static_cast<uint8_t>(std::lround(static_cast<float>(was) + static_cast<float>(is - was) * share));
  };
  into.colour = {mixed(into.colour.b, colour.b), mixed(into.colour.g, colour.g), mixed(into.colour.r, colour.r)};
  into.seen = static_cast<uint8_t>(std::min<int>(Tile::kMostSeen, into.seen + 1));
  into.missing = 0;
}

/// What remember() says of a point, without the padding behind it, and of a slot of the table.
constexpr size_t kPointBytes = offsetof(MapPoint, missing) + 1;
struct Entry {
  uint16_t slot, at;
};
static_assert(std::bit_ceil(2 * MapParameters{}.tile_points) <= 1 << 16);

}  // namespace

// Tile --------------------------------------------------------------------------------------------------------------

Tile::Tile(size_t points, double voxel_m) : size_(voxel_m), table_(std::bit_ceil(2 * points)) {
  points_.reserve(points);
}

void Tile::begin(const Transform& in_map, int64_t stamp_ns) {
  used_ = true;
  loose_ = false;
  in_map_ = in_map;
  stamp_ns_ = stamp_ns;
  reach_m_ = 0;
  points_.clear();
  std::fill(table_.begin(), table_.end(), 0u);
}

// The slot that holds the voxel, or the empty one where it belongs.
size_t Tile::slot_of(const cloud::VoxelIndex& voxel) const {
  const uint64_t mixed = (static_cast<uint64_t>(static_cast<uint32_t>(voxel.x)) * 0x9E3779B97F4A7C15u) ^
                         (static_cast<uint64_t>(static_cast<uint32_t>(voxel.y)) * 0xC2B2AE3D27D4EB4Fu) ^
                         (static_cast<uint64_t>(static_cast<uint32_t>(voxel.z)) * 0x165667B19E3779F9u);
  const size_t mask = table_.size() - 1;
  size_t slot = static_cast<size_t>(mixed >> 32) & mask;
  while (table_[slot] != 0 && size_.voxel_of(points_[table_[slot] - 1].place) != voxel) slot = (slot + 1) & mask;
  return slot;
}

MapPoint* Tile::at(const Point& place) {
  if (!size_.holds(place)) return nullptr;
  const uint32_t found = table_[slot_of(size_.voxel_of(place))];
  return found != 0 && points_[found - 1].seen > 0 ? &points_[found - 1] : nullptr;
}

bool Tile::add(const Point& place, const Colour& colour) {
  if (!size_.holds(place)) return false;
  const size_t slot = slot_of(size_.voxel_of(place));
  const MapPoint fresh{place, colour, 1, 0};
  if (table_[slot] != 0) {
    points_[table_[slot] - 1] = fresh;
  } else {
    if (full()) return false;
    points_.push_back(fresh);  // within the reserved capacity
    table_[slot] = static_cast<uint32_t>(points_.size());
  }
  reach_m_ = std::max(reach_m_, static_cast<double>(std::hypot(place.x, place.y, place.z)));
  return true;
}

void Tile::compact() {
  points_.erase(std::remove_if(points_.begin(), points_.end(), [](const MapPoint& p) { return p.seen == 0; }),
                points_.end());
  std::fill(table_.begin(), table_.end(), 0u);
  for (size_t i = 0; i < points_.size(); ++i)
    table_[slot_of(size_.voxel_of(points_[i].place))] = static_cast<uint32_t>(i + 1);
}

// The table as it is: a point that has moved to the border of its voxel stays in the slot that it was given.
void Tile::remember(StateArchive& archive) {
  TAKT_STATE(archive, used_);
  if (!used_) return;
  auto count = static_cast<uint32_t>(points_.size());
  TAKT_STATE(archive, loose_, in_map_, stamp_ns_, reach_m_, count);
  if (count > points_.capacity()) return archive.fail();
  if (archive.loads()) points_.resize(count);
  for (MapPoint& point : points_) archive.raw(&point, kPointBytes);
  if (archive.loads()) std::fill(table_.begin(), table_.end(), 0u);
  auto taken = static_cast<uint32_t>(std::count_if(table_.begin(), table_.end(), [](uint32_t at) { return at != 0; }));
  TAKT_STATE(archive, taken);
  for (uint32_t slot = 0; taken > 0 && !archive.failed(); --taken, ++slot) {
    while (!archive.loads() && table_[slot] == 0) ++slot;
    Entry entry{static_cast<uint16_t>(slot), static_cast<uint16_t>(archive.loads() ? 0 : table_[slot])};
    archive(entry);
    if (entry.slot >= table_.size() || entry.at > points_.size()) return archive.fail();
    if (archive.loads()) table_[entry.slot] = entry.at;
  }
}

// TileMap -----------------------------------------------------------------------------------------------------------

void TileMap::remember(StateArchive& archive) {
  size_t all = 0;
  for (const Tile& tile : tiles_) all += tile.used() ? tile.points().size() : 0;
  archive.room(tiles_.size() * sizeof(Tile) + kMostRemembered * (kPointBytes + sizeof(Entry)));
  if (all > kMostRemembered) return archive.fail();
  TAKT_STATE(archive, tiles_, dropped_, first_judged_);
}

TileMap::TileMap(const MapParameters& parameters) : p_(parameters) {
  tiles_.reserve(p_.tiles);
  for (size_t i = 0; i < p_.tiles; ++i) tiles_.emplace_back(p_.tile_points, p_.voxel_m);
  near_.reserve(p_.tiles);
}

// The tile whose anchor is nearest, if it has room; else a new one, for which the farthest makes room if it must.
Tile& TileMap::tile_for(const Transform& sensor_in_map, int64_t stamp_ns) {
  Tile *nearest = nullptr, *farthest = nullptr, *unused = nullptr;
  const auto away = [&](const Tile* tile) { return tile->distance_m(sensor_in_map); };
  for (Tile& tile : tiles_) {
    if (!tile.used()) {
      if (!unused) unused = &tile;
      continue;
    }
    if (away(&tile) <= p_.tile_m && tile.full()) tile.compact();
    if (away(&tile) <= p_.tile_m && !tile.full() && (!nearest || away(&tile) < away(nearest))) nearest = &tile;
    if (!farthest || away(&tile) > away(farthest)) farthest = &tile;
  }
  if (nearest) return *nearest;
  if (!unused) {
    dropped_ += static_cast<uint64_t>(std::count_if(farthest->points().begin(), farthest->points().end(),
                                                    [](const MapPoint& p) { return p.seen > 0; }));
    unused = farthest;
  }
  // Whole voxels from the map's origin: until they are corrected, all tiles divide space alike, so no voxel at the
  // border of two is kept twice.
  const auto whole = [&](double m) { return std::round(m / p_.voxel_m) * p_.voxel_m; };
  Transform in_map;
  in_map.x = whole(sensor_in_map.x), in_map.y = whole(sensor_in_map.y), in_map.z = whole(sensor_in_map.z);
  unused->begin(in_map, stamp_ns);
  return *unused;
}

void TileMap::gather_near(const Transform& sensor_in_map, double range_m, const Tile* but) {
  near_.clear();
  for (Tile& tile : tiles_)
    if (tile.used() && &tile != but && tile.distance_m(sensor_in_map) <= tile.reach_m() + range_m)
      near_.push_back({&tile, to_affine(seen_from(tile.in_map(), sensor_in_map)),  // within the reserved capacity
                       tile.reach_m() + std::sqrt(3.0) * p_.voxel_m});
}

MapPoint* TileMap::find_near(const Point& p, Point& place) {
  for (const Near& near : near_) {
    const Position at = placed(near.from_sensor, p);
    if (at.x_m * at.x_m + at.y_m * at.y_m + at.z_m * at.z_m > near.reach_m * near.reach_m) continue;
    place = point(at);
    if (MapPoint* found = near.tile->at(place)) return found;
  }
  return nullptr;
}

void TileMap::add(const cloud::CloudView& cloud, const Transform& sensor_in_map, int64_t stamp_ns) {
  Tile* tile = &tile_for(sensor_in_map, stamp_ns);
  double range_m = 0;
  for (const Point& p : cloud.points)
    if (cloud::usable(p)) range_m = std::max(range_m, static_cast<double>(std::hypot(p.x, p.y, p.z)));
  gather_near(sensor_in_map, range_m, tile);
  Affine to_tile = to_affine(seen_from(tile->in_map(), sensor_in_map));
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Point& p = cloud.points[i];
    const Colour colour = cloud.coloured() ? cloud.colours[i] : Colour{};
    Point place = point(placed(to_tile, p)), there;
    if (MapPoint* here = tile->at(place)) {
      merge(place, colour, *here);
    } else if (MapPoint* elsewhere = find_near(p, there)) {
      merge(there, colour, *elsewhere);
    } else if (!tile->add(place, colour) && tile->full()) {
      Tile& next = tile_for(sensor_in_map, stamp_ns);
      if (&next == tile) continue;
      gather_near(sensor_in_map, range_m, &next);
      tile = &next;
      to_tile = to_affine(seen_from(tile->in_map(), sensor_in_map));
      tile->add(point(placed(to_tile, p)), colour);
    }
  }
}

void TileMap::clear(Tile& tile, const SeenThrough& by) {
  const DepthView& view = by.view;
  const DepthCamera& camera = view.camera;
  const auto depth_at = [&](int u, int v) {
    return view.depth_m[static_cast<size_t>(v) * static_cast<size_t>(camera.width) + static_cast<size_t>(u)];
  };
  const Affine to_camera = to_affine(seen_from(view.camera_in_map, tile.in_map()));
  for (MapPoint& p : tile.points()) {
    const Position at = placed(to_camera, p.place);
    if (p.seen == 0 || !(at.z_m > 0) || at.z_m > by.range_max_m) continue;
    const double scale = camera.focal_px / at.z_m;
    const double u = at.x_m * scale + camera.cu_px + 0.5, v = at.y_m * scale + camera.cv_px + 0.5;
    if (!(u >= 1 && v >= 1 && u < camera.width - 1 && v < camera.height - 1)) continue;
    // At the edge of a thing its pixel may show what is behind: all nine around must see past it.
    bool through = true;
    for (int dv = -1; dv <= 1 && through; ++dv)
      for (int du = -1; du <= 1 && through; ++du) {
        const double seen = depth_at(static_cast<int>(u) + du, static_cast<int>(v) + dv);
        through = seen > 0 && at.z_m < seen - by.margin_m - by.tolerance_per_m2 * seen * seen;
      }
    if (through && ++p.missing > p.seen) p.seen = 0;
  }
}

void TileMap::join(Tile& tile) {
  gather_near(tile.in_map(), tile.reach_m(), &tile);
  for (MapPoint& p : tile.points()) {
    Point there;
    if (p.seen == 0) continue;
    if (MapPoint* other = find_near(p.place, there)) {
      merge(there, p.colour, *other);
      p.seen = 0;
    }
  }
  tile.joined();
}

void TileMap::correct(int64_t from_ns, int64_t to_ns, const Transform& believed, const Transform& actual) {
  const UncertainPose turn = compose({actual, {}}, inverse({believed, {}}));
  const Transform none;
  for (Tile& tile : tiles_) {
    if (!tile.used() || tile.stamp_ns() <= from_ns) continue;
    const double share =
        to_ns > from_ns
            ? std::min(1.0, static_cast<double>(tile.stamp_ns() - from_ns) / static_cast<double>(to_ns - from_ns))
            : 1.0;
    const Transform part = interpolate({none, {}}, turn, share).transform;
    Transform laid = compose({{0, 0, 0, part.qw, part.qx, part.qy, part.qz}, {}}, {tile.in_map(), {}}).transform;
    laid.x = tile.in_map().x + share * (actual.x - believed.x);
    laid.y = tile.in_map().y + share * (actual.y - believed.y);
    laid.z = tile.in_map().z + share * (actual.z - believed.z);
    tile.lay(laid);
  }
}

void TileMap::load(const cloud::CloudView& cloud) {
  struct Square {
    Point middle{};
    cloud::Cloud cloud;
  };
  const double edge_m = 2 * p_.tile_m;
  std::map<std::pair<int64_t, int64_t>, Square> squares;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Point& p = cloud.points[i];
    if (!cloud::usable(p)) continue;
    const auto column = static_cast<int64_t>(std::floor(p.x / edge_m)),
               row = static_cast<int64_t>(std::floor(p.y / edge_m));
    Square& square = squares[{column, row}];
    square.middle = point({(static_cast<double>(column) + 0.5) * edge_m, (static_cast<double>(row) + 0.5) * edge_m, 0});
    square.cloud.points.push_back({p.x - square.middle.x, p.y - square.middle.y, p.z});
    if (cloud.coloured()) square.cloud.colours.push_back(cloud.colours[i]);
  }
  for (const auto& [place, square] : squares) {
    Transform middle;
    middle.x = square.middle.x, middle.y = square.middle.y;
    add(square.cloud.view(), middle, 0);
  }
}

void TileMap::clear() {
  for (Tile& tile : tiles_) tile.end();
}

size_t TileMap::tiles() const {
  return static_cast<size_t>(std::count_if(tiles_.begin(), tiles_.end(), [](const Tile& t) { return t.used(); }));
}

size_t TileMap::points() const {
  size_t count = 0;
  for_each([&](const Position&, const MapPoint&) { ++count; });
  return count;
}

size_t TileMap::bytes() const {
  const size_t slots = std::bit_ceil(2 * p_.tile_points);
  return p_.tiles * (p_.tile_points * sizeof(MapPoint) + slots * sizeof(uint32_t));
}

}  // namespace takt::mapping_3d
