// SPDX-License-Identifier: Apache-2.0
#include "graph/run/world_truth.hpp"

namespace takt::command {

graph::WorldTruth world_truth(const hal::SimulatedWorld* world) {
  graph::WorldTruth truth;
  if (world == nullptr) return truth;
  truth.objects = world->objects();
  truth.attribute = [world](const std::string& object, const std::string& name, int64_t at_ns) {
    return world->attribute(object, name, at_ns);
  };
  truth.position = [world](const std::string& object, int64_t at_ns) { return world->position(object, at_ns); };
  return truth;
}

}  // namespace takt::command
