// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/sim/action_run.hpp"
#include "hal/sim/placed.hpp"
#include "hal/sim/robot.hpp"
#include "hal/sim/states.hpp"

namespace takt::sim {

/// What stands in a world at an instant, beside what never changes. Filled again and again without allocation.
struct Snapshot {
  std::vector<Placed> placed;
  Scene scene;  ///< of these; with its `fixed` the whole world
};

/// One world in time, shared by all its robots: each client of the world is a robot in it, whether a device moves it or
/// not. Constant parts are immutable; whatever commands change has one writer and lock-free readers, and is a function
/// of world, seed, commands and instant.
class Stage {
 public:
  static tl::expected<std::shared_ptr<Stage>, DeviceError> load(const std::string& device_id,
                                                                const std::filesystem::path& file, uint64_t seed);
  Stage(World world, uint64_t seed);

  const World& world() const { return world_; }
  uint64_t seed() const { return seed_; }
  /// What never changes.
  const Scene& scene() const { return scene_; }

  /// The first caller fixes the start of the world's time; later calls change nothing. Returns what is in force.
  int64_t begin(int64_t epoch_ns);
  int64_t epoch_ns() const { return epoch_ns_.load(std::memory_order_acquire); }

  Robot& robot(size_t client) { return *robots_[client]; }
  const Robot& robot(size_t client) const { return *robots_[client]; }
  ActionRun& actions(size_t client) { return *actions_[client]; }
  const ActionRun& actions(size_t client) const { return *actions_[client]; }
  States& states() { return states_; }
  const States& states() const { return states_; }

  /// Where an object stands; a carried one has no shape and is where its robot is. Nothing: it is not in the world.
  std::optional<Placed> placed(size_t object, int64_t at_ns) const;
  /// Of the objects that may change, and the robots but the one that looks.
  void look(size_t robot, int64_t at_ns, Snapshot& into) const;
  /// With memory for whatever look() fills in.
  Snapshot make_snapshot() const;
  /// Distance from `origin` along `direction` (unit) to the first wall, box, person or robot, to floor or ceiling.
  double cast_ray(const Snapshot& snapshot, const Vec3& origin, const Vec3& direction, double max_range) const;

  /// Whether a robot must not go from one place to the next. What moves or changes counts as it was 100 ms before: that
  /// is settled, whoever asks first. Another robot counts with the way that it can have made meanwhile.
  bool refuses(size_t robot, const Vec2& from, const Vec2& to, int64_t at_ns) const;

  /// True if no command can change any more how the world, but for the heads of its robots, is at that instant.
  bool settled(int64_t at_ns) const;

 private:
  std::optional<Placed> placed(size_t object, int64_t at_ns, int depth) const;

  World world_;
  States states_;
  uint64_t seed_;
  World fixed_;  ///< without the objects that may change
  Scene scene_;
  std::vector<size_t> changing_;
  std::atomic<int64_t> epoch_ns_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::vector<std::unique_ptr<ActionRun>> actions_;
};

}  // namespace takt::sim
