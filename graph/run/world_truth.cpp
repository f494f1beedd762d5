// SPDX-License-Identifier: Apache-2.0
#include "graph/run/world_truth.hpp"

#include <algorithm>

#include "hal/sim/simulation.hpp"

namespace takt::command {
namespace {

/// The robot of that client of the world; null if there is none of that name.
const sim::Robot* find_robot(const sim::Simulation& simulation, const std::string& name) {
  const auto& clients = simulation.world().clients;
  const auto found =
      std::find_if(clients.begin(), clients.end(), [&](const sim::Client& client) { return client.name == name; });
  return found == clients.end() ? nullptr : &simulation.stage().robot(static_cast<size_t>(found - clients.begin()));
}

std::optional<std::string> attribute(const sim::Simulation& simulation, const std::string& object,
                                     const std::string& name, int64_t at_ns) {
  if (const sim::Robot* robot = find_robot(simulation, object)) {
    const sim::RobotState state = robot->state(at_ns);
    if (name == "blocked") return robot->blocked() ? "true" : "false";
    if (name == "terrain") return terrain_under(simulation.world(), {state.x_m, state.y_m}, state.theta_rad);
  }
  return simulation.attribute(object, name, at_ns);
}

std::optional<std::array<double, 2>> position(const sim::Simulation& simulation, const std::string& object,
                                              int64_t at_ns) {
  if (const sim::Robot* robot = find_robot(simulation, object)) {
    const sim::RobotState state = robot->state(at_ns);
    return std::array{state.x_m, state.y_m};
  }
  const auto place = simulation.position(object, at_ns);
  if (!place) return std::nullopt;
  return std::array{place->x(), place->y()};
}

}  // namespace

graph::WorldTruth world_truth(const sim::Simulation* world) {
  graph::WorldTruth truth;
  if (world == nullptr) return truth;
  for (const sim::Client& client : world->world().clients) truth.objects.push_back(client.name);
  for (const sim::WorldObject& object : world->world().objects) truth.objects.push_back(object.name);
  truth.attribute = [world](const std::string& object, const std::string& name, int64_t at_ns) {
    return attribute(*world, object, name, at_ns);
  };
  truth.position = [world](const std::string& object, int64_t at_ns) { return position(*world, object, at_ns); };
  return truth;
}

}  // namespace takt::command
