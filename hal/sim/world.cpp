// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "hal/sim/placed.hpp"
#include "rt/file/input_file.hpp"

namespace takt::sim {
namespace {

constexpr int kMaxSide = 4000;

Quad wall(const Vec2& from, const Vec2& to, double height, Material material) {
  const Vec3 a(from.x(), from.y(), 0), b(to.x(), to.y(), 0), up(0, 0, height);
  // The offset depends on the place, so that parallel walls show different parts of the texture.
  return make_quad({a, b, b + up, a + up}, material, 0.173 * (from.x() + 3.1 * from.y()));
}

/// Borders between free and occupied cells along one axis, merged to straight runs. A wall's front looks to the free
/// side.
void add_walls(const World& world, Scene& scene) {
  const Bitmap& map = world.map;
  const double cell = map.cell_m;
  for (const bool horizontal : {true, false}) {
    const int lines = horizontal ? map.height : map.width, length = horizontal ? map.width : map.height;
    const auto occupied = [&](int along, int across) {
      return horizontal ? map.at(along, across) : map.at(across, along);
    };
    for (int line = 0; line <= lines; ++line) {
      for (const bool free_below : {true, false}) {
        const auto border = [&](int along) {
          return along < length && occupied(along, line) == free_below && occupied(along, line - 1) != free_below;
        };
        for (int start = 0; start < length; ++start) {
          if (!border(start)) continue;
          int end = start + 1;
          while (border(end)) ++end;
          const double s = start * cell, e = end * cell, at = line * cell;
          const Vec2 p = horizontal ? Vec2(s, at) : Vec2(at, s), q = horizontal ? Vec2(e, at) : Vec2(at, e);
          // Running along +x with up = +z, the normal of make_quad points to -y; along +y it points to +x.
          const bool forward = horizontal == free_below;
          scene.quads.push_back(forward ? wall(p, q, world.wall_height_m, world.wall)
                                        : wall(q, p, world.wall_height_m, world.wall));
          start = end;
        }
      }
    }
  }
}

/// Exact traversal of the cells below the ray (Amanatides and Woo 1987); in lengths of `direction`, of any length.
double cast_map(const Bitmap& map, const Vec2& origin, const Vec2& direction, double max_range) {
  int column = static_cast<int>(std::floor(origin.x() / map.cell_m)),
      row = static_cast<int>(std::floor(origin.y() / map.cell_m));
  if (map.at(column, row)) return 0;
  const double infinity = std::numeric_limits<double>::infinity();
  const auto first = [&](double o, double d, int cell) {
    return d > 0 ? ((cell + 1) * map.cell_m - o) / d : d < 0 ? (cell * map.cell_m - o) / d : infinity;
  };
  double tx = first(origin.x(), direction.x(), column), ty = first(origin.y(), direction.y(), row);
  const double step_x = direction.x() != 0 ? map.cell_m / std::abs(direction.x()) : infinity;
  const double step_y = direction.y() != 0 ? map.cell_m / std::abs(direction.y()) : infinity;
  for (;;) {
    const bool along_x = tx < ty;
    const double t = along_x ? tx : ty;
    if (t >= max_range) return max_range;
    if (along_x) {
      column += direction.x() > 0 ? 1 : -1;
      tx += step_x;
    } else {
      row += direction.y() > 0 ? 1 : -1;
      ty += step_y;
    }
    if (map.at(column, row)) return t;
  }
}

/// Next token of a PGM header, comments skipped.
std::string token(std::istream& in) {
  std::string word;
  while (in >> word) {
    if (word.front() != '#') return word;
    std::string rest;
    std::getline(in, rest);
  }
  return "";
}

}  // namespace

tl::expected<Bitmap, std::string> load_pgm(const std::filesystem::path& file, double cell_m) {
  if (const std::string why = why_unreadable(file); !why.empty())
    return tl::unexpected("the map " + file.string() + " " + why);
  std::ifstream in(file, std::ios::binary);
  const std::string magic = token(in), width = token(in), height = token(in), peak = token(in);
  Bitmap map;
  map.cell_m = cell_m;
  map.width = std::atoi(width.c_str());
  map.height = std::atoi(height.c_str());
  const int maximum = std::atoi(peak.c_str());
  if ((magic != "P5" && magic != "P2") || map.width < 3 || map.height < 3 || map.width > kMaxSide ||
      map.height > kMaxSide || maximum < 1 || maximum > 255) {
    return tl::unexpected("the map " + file.string() + " is no 8-bit PGM of 3..4000 pixels a side");
  }
  in.get();
  map.occupied.resize(static_cast<size_t>(map.width) * static_cast<size_t>(map.height));
  for (int row = map.height - 1; row >= 0; --row) {
    for (int column = 0; column < map.width; ++column) {
      int value = -1;
      if (magic == "P5") value = in.get();
      else in >> value;
      if (!in || value < 0) return tl::unexpected("the map " + file.string() + " ends early");
      map.occupied[static_cast<size_t>(row * map.width + column)] = 2 * value < maximum ? 1 : 0;
    }
  }
  return map;
}

tl::expected<Bitmap, std::string> parse_rows(const std::string& text, double cell_m) {
  std::vector<std::string> rows;
  std::istringstream in(text);
  for (std::string row; in >> row;) rows.push_back(row);
  if (rows.size() < 3 || rows.size() > kMaxSide || rows[0].size() < 3)
    return tl::unexpected(std::string("<rows> needs at least 3 x 3 cells"));
  Bitmap map;
  map.cell_m = cell_m;
  map.width = static_cast<int>(rows[0].size());
  map.height = static_cast<int>(rows.size());
  for (size_t i = rows.size(); i-- > 0;) {
    if (rows[i].size() != rows[0].size()) {
      return tl::unexpected("row " + std::to_string(i + 1) + " of <rows> has " + std::to_string(rows[i].size()) +
                            " cells, the first has " + std::to_string(rows[0].size()));
    }
    for (const char c : rows[i]) map.occupied.push_back(c == '#' ? 1 : 0);
  }
  return map;
}

Scene build_scene(const World& world, std::shared_ptr<const TextureSet> textures) {
  Scene scene;
  scene.textures = std::move(textures);
  const double w = world.map.width * world.map.cell_m, h = world.map.height * world.map.cell_m,
               top = world.wall_height_m;
  scene.quads.push_back(make_quad({Vec3(0, 0, 0), Vec3(w, 0, 0), Vec3(w, h, 0), Vec3(0, h, 0)}, world.floor));
  scene.quads.push_back(make_quad({Vec3(0, h, top), Vec3(w, h, top), Vec3(w, 0, top), Vec3(0, 0, top)}, world.ceiling));
  constexpr double kThickness = 0.001;
  double z = 0;
  for (const TerrainPatch& patch : world.terrain) {
    z += kThickness;
    const auto corner = [&](double x, double y) {
      return Vec3(patch.middle.x() + x * patch.width_m / 2, patch.middle.y() + y * patch.depth_m / 2, z);
    };
    scene.quads.push_back(make_quad({corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)}, patch.material));
  }
  add_walls(world, scene);
  for (const WorldObject& object : world.objects) add_placed(scene, as_it_begins(object), texture_offset(scene));
  return scene;
}

std::string_view terrain_at(const World& world, const Vec2& place) {
  const auto covers = [&](const TerrainPatch& patch) {
    const Vec2 off = (place - patch.middle).cwiseAbs();
    return off.x() <= patch.width_m / 2 && off.y() <= patch.depth_m / 2;
  };
  const auto top = std::find_if(world.terrain.rbegin(), world.terrain.rend(), covers);
  return top == world.terrain.rend() ? std::string_view("floor") : std::string_view(top->name);
}

std::string terrain_under(const World& world, const Vec2& middle, double theta_rad) {
  constexpr int kAlong = 8, kAcross = 6;
  const Vec2 ahead(std::cos(theta_rad), std::sin(theta_rad)), left(-ahead.y(), ahead.x());
  std::set<std::string_view> names;
  for (int i = 0; i <= kAlong; ++i)
    for (int j = 0; j <= kAcross; ++j)
      names.insert(terrain_at(world, middle + kRobotLength * (static_cast<double>(i) / kAlong - 0.5) * ahead +
                                         kRobotWidth * (static_cast<double>(j) / kAcross - 0.5) * left));
  std::string all;
  for (const std::string_view name : names) all.append(all.empty() ? "" : ", ").append(name);
  return all;
}

double cast_ray(const World& world, const Scene& scene, const Vec3& origin, const Vec3& direction, double max_range) {
  double nearest = cast_map(world.map, origin.head<2>(), direction.head<2>(), max_range);
  if (direction.z() != 0) {
    const double plane_z = direction.z() > 0 ? world.wall_height_m : 0;
    nearest = std::min(nearest, std::max(0.0, (plane_z - origin.z()) / direction.z()));
  }
  for (const WorldObject& object : world.objects)
    nearest = std::min(nearest, cast_box(as_it_begins(object), origin, direction));
  return std::min({nearest, cast_capsules(scene.capsules, origin, direction), max_range});
}

bool collides(const World& world, const Vec2& centre, double radius) {
  const Bitmap& map = world.map;
  const int reach = static_cast<int>(std::ceil(radius / map.cell_m)) + 1;
  const int column = static_cast<int>(std::floor(centre.x() / map.cell_m)),
            row = static_cast<int>(std::floor(centre.y() / map.cell_m));
  for (int r = row - reach; r <= row + reach; ++r) {
    for (int c = column - reach; c <= column + reach; ++c) {
      if (!map.at(c, r)) continue;
      const double dx = std::max({c * map.cell_m - centre.x(), centre.x() - (c + 1) * map.cell_m, 0.0});
      const double dy = std::max({r * map.cell_m - centre.y(), centre.y() - (r + 1) * map.cell_m, 0.0});
      if (dx * dx + dy * dy < radius * radius) return true;
    }
  }
  return std::any_of(world.objects.begin(), world.objects.end(),
                     [&](const WorldObject& object) { return touches(as_it_begins(object), centre, radius); });
}

}  // namespace takt::sim
