// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/stage.hpp"

#include <algorithm>
#include <limits>

namespace takt::sim {
namespace {

constexpr int64_t kNoEpoch = std::numeric_limits<int64_t>::min();
constexpr size_t kMostQuads = 8, kMostCapsules = 13;  // of one shape: a box, a board and a shirt; a person

/// A robot as the others see it, as high as the one of the thesis.
const Shape& robot_shape() {
  static const Shape shape{Box{kRobotLength, kRobotWidth, 1.78, 0, Material::cloth}, {}, {}};
  return shape;
}
const Shape& no_shape() {
  static const Shape shape;
  return shape;
}

World without(World world, const std::vector<size_t>& objects) {
  for (auto i = objects.rbegin(); i != objects.rend(); ++i)
    world.objects.erase(world.objects.begin() + static_cast<ptrdiff_t>(*i));
  return world;
}

std::vector<size_t> changing(const World& world, const States& states) {
  std::vector<size_t> objects;
  for (size_t i = 0; i < world.objects.size(); ++i)
    if (states.changes(i)) objects.push_back(i);
  return objects;
}

/// The first place on the path of a client that is not free; nothing: there is none.
std::optional<Vec2> obstacle(const World& world, const Path& path) {
  for (double t = 0; !path.empty() && t < path.lap_s() + 60; t += 0.1) {
    const RobotState s = path.at(t);
    if (collides(world, Vec2(s.x_m, s.y_m), 0.3)) return Vec2(s.x_m, s.y_m);
  }
  return std::nullopt;
}

}  // namespace

tl::expected<std::shared_ptr<Stage>, DeviceError> Stage::load(const std::string& device_id,
                                                              const std::filesystem::path& file, uint64_t seed) {
  auto world = load_world(device_id, file);
  if (!world) return tl::unexpected(world.error());
  auto stage = std::make_shared<Stage>(std::move(*world), seed);
  for (const auto& robot : stage->robots_) {
    const auto at = obstacle(stage->fixed_, robot->path());
    if (!at) continue;
    return device_error(device_id,
                        file.string() + ": the path of `" + robot->client().name + "` hits an obstacle near x = " +
                            std::to_string(at->x()) + " m, y = " + std::to_string(at->y()) + " m",
                        "move the waypoints (the curve between them is a cubic spline) or the obstacle");
  }
  return stage;
}

Stage::Stage(World world, uint64_t seed)
    : world_(std::move(world)),
      states_(world_),
      seed_(seed),
      fixed_(without(world_, changing(world_, states_))),
      scene_(build_scene(fixed_, textures_of(seed))),
      changing_(changing(world_, states_)),
      epoch_ns_(kNoEpoch) {
  for (size_t i = 0; i < world_.clients.size(); ++i) {
    robots_.push_back(std::make_unique<Robot>(*this, i));
    actions_.push_back(std::make_unique<ActionRun>(*this, i));
  }
}

int64_t Stage::begin(int64_t epoch_ns) {
  int64_t expected = kNoEpoch;
  epoch_ns_.compare_exchange_strong(expected, epoch_ns, std::memory_order_acq_rel);
  return epoch_ns_.load(std::memory_order_acquire);
}

std::optional<Placed> Stage::placed(size_t object, int64_t at_ns) const {
  return placed(object, at_ns, static_cast<int>(world_.objects.size()));
}

/// `depth`: so many objects may stand on each other.
std::optional<Placed> Stage::placed(size_t object, int64_t at_ns, int depth) const {
  const int64_t since = at_ns - epoch_ns();
  const Whereabouts& where = states_.whereabouts(object, since);
  Placed placed{&states_.shape(object, since), where.position, where.yaw_rad, 0};
  switch (where.kind) {
    case Whereabouts::Kind::at: return placed;
    case Whereabouts::Kind::on: {
      const auto below = depth > 0 ? this->placed(where.index, at_ns, depth - 1) : std::nullopt;
      if (!below) return std::nullopt;
      placed.position = below->position;
      placed.yaw_rad = below->yaw_rad;
      placed.lift_m = top_m(*below) - (placed.shape->box ? placed.shape->box->z_m : 0);
      return placed;
    }
    case Whereabouts::Kind::carried: {
      const RobotState robot = robots_[where.index]->state(at_ns);
      return Placed{&no_shape(), {robot.x_m, robot.y_m}, robot.theta_rad, 0};
    }
    case Whereabouts::Kind::away: return std::nullopt;
  }
  return std::nullopt;
}

Snapshot Stage::make_snapshot() const {
  Snapshot snapshot;
  const size_t most = changing_.size() + robots_.size();
  snapshot.placed.reserve(most);
  snapshot.scene.quads.reserve(kMostQuads * most);
  snapshot.scene.capsules.reserve(kMostCapsules * changing_.size());
  snapshot.scene.textures = scene_.textures;
  snapshot.scene.fixed = &scene_;
  return snapshot;
}

void Stage::look(size_t robot, int64_t at_ns, Snapshot& into) const {
  into.placed.clear();
  into.scene.quads.clear();
  into.scene.capsules.clear();
  const auto add = [&](const Placed& placed, size_t number) {
    into.placed.push_back(placed);
    add_moving(into.scene, placed, texture_start(number));
  };
  for (const size_t object : changing_) {
    const auto placed = this->placed(object, at_ns);
    if (placed && !placed->shape->empty()) add(*placed, object);
  }
  for (size_t i = 0; i < robots_.size(); ++i) {
    if (i == robot) continue;
    const RobotState s = robots_[i]->state(at_ns);
    add({&robot_shape(), {s.x_m, s.y_m}, s.theta_rad, 0}, world_.objects.size() + i);
  }
}

double Stage::cast_ray(const Snapshot& snapshot, const Vec3& origin, const Vec3& direction, double max_range) const {
  double nearest = sim::cast_ray(fixed_, scene_, origin, direction, max_range);
  for (const Placed& placed : snapshot.placed) nearest = std::min(nearest, cast_box(placed, origin, direction));
  return std::min(nearest, cast_capsules(snapshot.scene.capsules, origin, direction));
}

bool Stage::refuses(size_t robot, const Vec2& from, const Vec2& to, int64_t at_ns) const {
  const int64_t before_ns = at_ns - kLatencyNs;
  // Whoever is inside something already may leave it.
  const auto enters = [&](const auto& meets) { return meets(to) && !meets(from); };
  if (enters([&](const Vec2& centre) { return collides(fixed_, centre, kFootprintRadius); })) return true;
  for (const size_t object : changing_) {
    const auto placed = this->placed(object, before_ns);
    if (placed && enters([&](const Vec2& centre) { return touches(*placed, centre, kFootprintRadius); })) return true;
  }
  for (size_t i = 0; i < robots_.size(); ++i) {
    if (i == robot) continue;
    const RobotState other = robots_[i]->state(before_ns);
    const double latency_s = kLatencyNs * 1e-9;
    const double way = (std::abs(other.speed_m_s) + kMaxAcceleration * latency_s) * latency_s;
    const Vec2 centre(other.x_m, other.y_m);
    const double distance = (to - centre).norm();
    if (distance < 2 * kFootprintRadius + way && distance < (from - centre).norm()) return true;
  }
  return false;
}

bool Stage::settled(int64_t at_ns) const {
  return std::all_of(robots_.begin(), robots_.end(), [&](const auto& robot) { return robot->base_settled(at_ns); }) &&
         std::all_of(actions_.begin(), actions_.end(),
                     [&](const auto& actions) { return actions->settled_ns() >= at_ns; });
}

}  // namespace takt::sim
