// SPDX-License-Identifier: Apache-2.0
#include "graph/command/world_truth.hpp"

#include <algorithm>

#include "hal/sim/simulation.hpp"

namespace takt::command {
namespace {

const sim::WorldObject* find_object(const sim::World& world, const std::string& name) {
  const auto found = std::find_if(world.objects.begin(), world.objects.end(),
                                  [&](const sim::WorldObject& object) { return object.name == name; });
  return found == world.objects.end() ? nullptr : &*found;
}

bool is_robot(const sim::World& world, const std::string& name) {
  return std::any_of(world.clients.begin(), world.clients.end(),
                     [&](const sim::Client& client) { return client.name == name; });
}

std::optional<std::string> attribute(const sim::Simulation& simulation, const std::string& object,
                                     const std::string& name) {
  if (is_robot(simulation.world(), object) && name == "blocked") return simulation.blocked() ? "true" : "false";
  const sim::WorldObject* found = find_object(simulation.world(), object);
  if (found == nullptr || !found->attributes.contains(name)) return std::nullopt;
  return found->attributes.at(name);
}

std::optional<std::array<double, 2>> position(const sim::Simulation& simulation, const std::string& object,
                                              int64_t at_ns) {
  if (is_robot(simulation.world(), object)) {
    const sim::RobotState robot = simulation.robot(at_ns);
    return std::array{robot.x_m, robot.y_m};
  }
  const sim::WorldObject* found = find_object(simulation.world(), object);
  if (found == nullptr) return std::nullopt;
  return std::array{found->position.x(), found->position.y()};
}

}  // namespace

graph::WorldTruth world_truth(const sim::Simulation* world) {
  graph::WorldTruth truth;
  if (world == nullptr) return truth;
  for (const sim::Client& client : world->world().clients) truth.objects.push_back(client.name);
  for (const sim::WorldObject& object : world->world().objects) truth.objects.push_back(object.name);
  truth.attribute = [world](const std::string& object, const std::string& name, int64_t) {
    return attribute(*world, object, name);
  };
  truth.position = [world](const std::string& object, int64_t at_ns) { return position(*world, object, at_ns); };
  return truth;
}

}  // namespace takt::command
