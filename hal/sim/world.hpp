// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hal/device.hpp"
#include "hal/sim/scene.hpp"

namespace takt::sim {

/// Occupancy bitmap. Cell (column, row) covers [column, column + 1) x [row, row + 1) cells of the map frame: row 0 is
/// the bottom (smallest y), although an image file starts at the top.
struct Bitmap {
  int width = 0, height = 0;
  double cell_m = 0;
  std::vector<uint8_t> occupied;
  bool inside(int column, int row) const { return column >= 0 && row >= 0 && column < width && row < height; }
  /// Outside the map everything is occupied.
  bool at(int column, int row) const {
    return !inside(column, row) ||
           occupied[static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column)] != 0;
  }
};

struct Box {
  double width_m = 0, depth_m = 0, height_m = 0, z_m = 0;  ///< z of the underside
  Material material = Material::wood;
};
/// A picture that hangs free, facing the object's yaw: cameras see it from that side; lasers and collisions do not.
struct Board {
  double edge_m = 0, z_m = 0;  ///< z of the lower edge
  std::shared_ptr<const Texture> picture;
};
struct Person {
  double height_m = 1.75;
  bool points = false;
  double pointing_rad = 0;
};

struct WorldObject {
  std::string name, type;
  Vec2 position = Vec2::Zero();
  double yaw_rad = 0;
  std::map<std::string, std::string> attributes;
  std::optional<Box> box;
  std::optional<Person> person;
  std::optional<Board> board;
};

struct Waypoint {
  double x_m = 0, y_m = 0;
};
struct PathRequest {
  std::vector<Waypoint> waypoints;
  double speed_m_s = 0.4, turn_rad_s = 0.35, acceleration_m_s2 = 0.3;
  bool loop = true;
};
struct Client {
  std::string name;
  double x_m = 0, y_m = 0, theta_rad = 0;
  PathRequest path;  ///< no waypoints: the client waits for velocity commands
};

/// Level of a digital line that differs from its resting level for a while.
struct LinePulse {
  double from_s = 0, until_s = 0;
};
struct WorldLine {
  uint32_t index = 0;
  std::string name;
  bool rest = true;
  std::vector<LinePulse> pulses;
};

struct RoleCondition {
  std::string role, attribute, value;
};
struct WorldAction {
  std::string name;
  double cost_s = 0;
  std::map<std::string, std::string> roles;  ///< role name -> object type
  std::vector<RoleCondition> pre, post;
};

/// The simulated world (algorithms.md section 13): immutable after loading.
struct World {
  std::string name;
  Bitmap map;
  double wall_height_m = 2.8;
  Material floor = Material::floor, wall = Material::plaster, ceiling = Material::ceiling;
  std::vector<Client> clients;
  std::vector<WorldObject> objects;
  std::vector<WorldLine> lines;
  std::vector<WorldAction> actions;
};

/// Reads an XML world and its bitmap. Errors name file:line, the element and the valid alternatives.
tl::expected<World, DeviceError> load_world(const std::string& device_id, const std::filesystem::path& file);
/// A PGM (P2 or P5, 8 bit; darker than half is occupied).
tl::expected<Bitmap, std::string> load_pgm(const std::filesystem::path& file, double cell_m);
/// Rows of text, top first; '#' is occupied.
tl::expected<Bitmap, std::string> parse_rows(const std::string& text, double cell_m);

/// Floor, ceiling, walls (one rectangle for each straight run of cell borders), boxes and people.
Scene build_scene(const World& world, std::shared_ptr<const TextureSet> textures);

/// Distance from `origin` along `direction` (unit) to the first wall, box or person, to floor or ceiling; `max_range`
/// if nothing is nearer.
double cast_ray(const World& world, const Scene& scene, const Vec3& origin, const Vec3& direction, double max_range);

/// True if a circle touches a wall, a box or a person.
bool collides(const World& world, const Vec2& centre, double radius);

}  // namespace takt::sim
