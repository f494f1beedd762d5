// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/sim/simulation.hpp"

namespace takt::test {

/// A room of 6 m x 5 m with one box, one person and a pillar; the robot waits for commands.
inline sim::World small_world() {
  sim::World world;
  world.name = "small";
  world.map.cell_m = 0.1;
  world.map.width = 60;
  world.map.height = 50;
  world.map.occupied.assign(3000, 0);
  const auto fill = [&](int x0, int y0, int x1, int y1) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) world.map.occupied[static_cast<size_t>(y * 60 + x)] = 1;
    }
  };
  fill(0, 0, 60, 1), fill(0, 49, 60, 50), fill(0, 0, 1, 50), fill(59, 0, 60, 50), fill(40, 8, 43, 11);
  world.clients.push_back({"ace", 1.5, 2.5, 0.0, {}});
  sim::WorldObject box;
  box.name = "box", box.type = "box", box.position = {4.0, 3.2}, box.yaw_rad = 0.4;
  box.box = sim::Box{0.6, 0.5, 0.9, 0.0, sim::Material::cardboard};
  sim::WorldObject person;
  person.name = "person", person.type = "person", person.position = {4.4, 2.0}, person.yaw_rad = 3.0;
  person.person = sim::Person{1.75, true, 2.0};
  world.objects = {box, person};
  return world;
}

inline StereoRig small_rig() {
  StereoRig rig;
  rig.model = "small";
  rig.width = 160, rig.height = 120, rig.channels = 3;
  rig.hfov_rad = 1.15, rig.baseline_m = 0.24;
  rig.focal_px = 80 / std::tan(1.15 / 2), rig.cu_px = 79.5, rig.cv_px = 59.5;
  rig.z_m = 1.3, rig.y_m = 0.1, rig.tilt_rad = -0.2, rig.on_head = true;
  return rig;
}

inline std::unique_ptr<sim::Simulation> small_simulation(uint64_t seed = 3) {
  return std::make_unique<sim::Simulation>(small_world(), 0, seed);
}

inline sim::PathRequest small_path() {
  return {{{1.5, 2.5}, {2.3, 1.5}, {3.2, 1.4}, {3.3, 2.6}, {2.6, 3.6}, {1.7, 3.4}}, 0.4, 0.35, 0.3, true};
}

/// Of one client that drives along small_path().
inline sim::World path_world() {
  sim::World world = small_world();
  world.clients[0].path = small_path();
  return world;
}

}  // namespace takt::test
