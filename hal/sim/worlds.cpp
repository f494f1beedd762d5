// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/worlds.hpp"

#include <algorithm>
#include <map>

namespace takt::sim {
namespace {

/// The robot of that client of the world; null if there is none of that name.
const Robot* find_robot(const Simulation& simulation, const std::string& name) {
  const auto& clients = simulation.world().clients;
  const auto found =
      std::find_if(clients.begin(), clients.end(), [&](const Client& client) { return client.name == name; });
  return found == clients.end() ? nullptr : &simulation.stage().robot(static_cast<size_t>(found - clients.begin()));
}

std::optional<std::string> attribute(const Simulation& simulation, const std::string& object, const std::string& name,
                                     int64_t at_ns) {
  if (const Robot* robot = find_robot(simulation, object)) {
    const RobotState state = robot->state(at_ns);
    if (name == "blocked") return robot->blocked() ? "true" : "false";
    if (name == "terrain") return terrain_under(simulation.world(), {state.x_m, state.y_m}, state.theta_rad);
  }
  return simulation.attribute(object, name, at_ns);
}

std::optional<std::array<double, 2>> position(const Simulation& simulation, const std::string& object, int64_t at_ns) {
  if (const Robot* robot = find_robot(simulation, object)) {
    const RobotState state = robot->state(at_ns);
    return std::array{state.x_m, state.y_m};
  }
  const auto place = simulation.position(object, at_ns);
  if (!place) return std::nullopt;
  return std::array{place->x(), place->y()};
}

/// The worlds of one process.
class Worlds : public hal::SimulatedWorld {
 public:
  tl::expected<Simulation*, DeviceError> of(const hal::DeviceConfig& config) {
    Settings settings(config.id, config.settings, config.directory);
    const auto file = settings.path("world", true);
    const std::string client = settings.text("client", "");
    if (settings.error()) return tl::unexpected(*settings.error());
    const std::string key = std::filesystem::weakly_canonical(file).string() + "\n" + std::to_string(config.seed);
    auto stage = stages_.find(key);
    if (stage == stages_.end()) {
      auto loaded = Stage::load(config.id, file, config.seed);
      if (!loaded) return tl::unexpected(loaded.error());
      stage = stages_.emplace(key, std::move(*loaded)).first;
    }
    const auto index = Simulation::find_client(*stage->second, config.id, file, client);
    if (!index) return tl::unexpected(index.error());
    auto& robot = robots_[{key, *index}];
    if (!robot) robot = std::make_unique<Simulation>(stage->second, *index);
    return robot.get();
  }

  Simulation* first() const { return robots_.empty() ? nullptr : robots_.begin()->second.get(); }

  std::vector<std::string> objects() const override {
    std::vector<std::string> names;
    if (first() == nullptr) return names;
    for (const Client& client : first()->world().clients) names.push_back(client.name);
    for (const WorldObject& object : first()->world().objects) names.push_back(object.name);
    return names;
  }
  std::optional<std::string> attribute(const std::string& object, const std::string& name,
                                       int64_t at_ns) const override {
    return first() == nullptr ? std::nullopt : sim::attribute(*first(), object, name, at_ns);
  }
  std::optional<std::array<double, 2>> position(const std::string& object, int64_t at_ns) const override {
    return first() == nullptr ? std::nullopt : sim::position(*first(), object, at_ns);
  }
  hal::SimulatorUse use() const override {
    const SimulatorCost cost = simulator_cost();
    return {cost.total_ns(), cost.in_read_ns};
  }

 private:
  std::map<std::string, std::shared_ptr<Stage>> stages_;                          ///< by file and seed
  std::map<std::pair<std::string, size_t>, std::unique_ptr<Simulation>> robots_;  ///< by that and client
};

}  // namespace

tl::expected<Simulation*, DeviceError> world_of(const hal::DeviceConfig& config, hal::Devices& devices) {
  auto& worlds = devices.shared<Worlds>();
  devices.offer(worlds);
  return worlds.of(config);
}

Simulation* first_world(hal::Devices& devices) { return devices.shared<Worlds>().first(); }

void choose_drive(Settings& settings, Simulation& world) {
  const std::string drive = settings.text("drive", world.path().empty() ? "command" : "path");
  if (drive == "command") world.set_drive(Drive::command);
  else if (drive != "path") settings.fail("`drive` is `" + drive + "`", "use path or command");
  else if (world.path().empty())
    settings.fail("`drive: path`, but the world's client has no <path>", "add one, or use drive: command");
}

}  // namespace takt::sim
