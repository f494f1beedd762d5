// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
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
  std::shared_ptr<const Texture> shirt = nullptr;  ///< before the chest and behind the back, where there is one
};
constexpr double kShirtEdge = 0.48;  ///< m, of a person of 1.75 m

/// What there is of an object: cameras see all of it, lasers and collisions boxes and persons.
struct Shape {
  std::optional<Box> box;
  std::optional<Person> person;
  std::optional<Board> board;
  bool empty() const { return !box && !person && !board; }
};
/// "The attribute has the value."
struct Condition {
  std::string attribute, value;
};
/// An object's shape while all conditions hold; an empty one: it is not there.
struct Look {
  std::vector<Condition> when;
  Shape shape;
};

struct WorldObject : Shape {
  std::string name, type;
  Vec2 position = Vec2::Zero();
  double yaw_rad = 0;
  std::map<std::string, std::string> attributes;  ///< at the beginning
  std::vector<Look> looks;                        ///< the first that holds is the object's shape, else its own is
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
struct ActionRole {
  std::string name, type;  ///< type of the object
};
/// Where an action takes the object of a role: `robot`: the robot carries it; `away`: out of the world; the name of
/// another role: on top of that one's object.
struct RoleMove {
  std::string role, to;
};

/// How near the robot's centre must be to everything that an action is about, m.
constexpr double kReach = 0.8;

struct WorldAction {
  std::string name;
  double cost_s = 0;
  double reach_m = kReach;
  std::vector<ActionRole> roles;  ///< as commands name their objects
  std::vector<RoleCondition> pre, post;
  std::vector<RoleMove> moves;
};

/// What the floor is like on a level rectangle. Cameras see its material; lasers and collisions see no difference.
struct TerrainPatch {
  std::string name;
  Vec2 middle = Vec2::Zero();
  double width_m = 0, depth_m = 0;  ///< along x, along y
  Material material = Material::asphalt;
};

/// What happens by itself: an attribute gets a value or, if `attribute` is empty, the object is put elsewhere.
struct WorldEvent {
  double at_s = 0;
  std::string object, attribute, value;
  bool away = false;  ///< out of the world, instead of to:
  Vec2 position = Vec2::Zero();
  double yaw_rad = 0;
};

/// The simulated world as it begins, and what can happen in it; what has happened is in a
/// Stage.
struct World {
  std::string name;
  Bitmap map;
  double wall_height_m = 2.8;
  Material floor = Material::floor, wall = Material::plaster, ceiling = Material::ceiling;
  std::vector<Client> clients;
  std::vector<WorldObject> objects;
  std::vector<TerrainPatch> terrain;  ///< later ones lie on earlier ones
  std::vector<WorldLine> lines;
  std::vector<WorldAction> actions;
  std::vector<WorldEvent> events;  ///< in the order of their instants
};

/// Reads an XML world and its bitmap. Errors name file:line, the element and the valid alternatives.
tl::expected<World, DeviceError> load_world(const std::string& device_id, const std::filesystem::path& file);
/// A PGM (P2 or P5, 8 bit; darker than half is occupied).
tl::expected<Bitmap, std::string> load_pgm(const std::filesystem::path& file, double cell_m);
/// Rows of text, top first; '#' is occupied.
tl::expected<Bitmap, std::string> parse_rows(const std::string& text, double cell_m);

/// Floor, ceiling, walls (one rectangle for each straight run of cell borders), and the objects as they begin.
Scene build_scene(const World& world, std::shared_ptr<const TextureSet> textures);

/// Of a robot as others see it, m.
constexpr double kRobotLength = 0.78, kRobotWidth = 0.56;

/// Names of all terrains under a robot's outline, looked at every 0.1 m at most: "crossing, floor".
std::string terrain_under(const World& world, const Vec2& middle, double theta_rad);
/// Name of the terrain at a place of the floor; "floor" where there is none.
std::string_view terrain_at(const World& world, const Vec2& place);

/// Distance from `origin` along `direction` (unit) to the first wall, box or person, to floor or ceiling; `max_range`
/// if nothing is nearer. The scene is that of the world.
double cast_ray(const World& world, const Scene& scene, const Vec3& origin, const Vec3& direction, double max_range);

/// True if a circle touches a wall, a box or a person.
bool collides(const World& world, const Vec2& centre, double radius);

}  // namespace takt::sim
