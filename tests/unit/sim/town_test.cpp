// SPDX-License-Identifier: Apache-2.0
// Terrain, shirts and people who walk, on the town that is shipped.
#include <doctest/doctest.h>

#include <cmath>

#include "hal/sim/simulation.hpp"

using namespace takt;
using namespace takt::sim;

namespace {

std::unique_ptr<Simulation> town() {
  auto loaded = Simulation::load("camera", TAKT_SOURCE_DIR "/graph/worlds/town.xml", "", 1);
  REQUIRE(loaded.has_value());
  (*loaded)->begin(0);
  return std::move(*loaded);
}

int64_t at_s(double seconds) { return std::llround(seconds * 1e9); }

}  // namespace

TEST_CASE("terrain: the later patch lies on the earlier one, floor is where none is") {
  const auto simulation = town();
  const World& world = simulation->world();
  CHECK(terrain_at(world, {4, 3}) == "floor");
  CHECK(terrain_at(world, {16, 7}) == "street");
  CHECK(terrain_at(world, {18, 5.2}) == "street");
  CHECK(terrain_at(world, {18, 4.9}) == "crossing");
  CHECK(terrain_at(world, {14.9, 3}) == "floor");
  CHECK(terrain_at(world, {15.1, 3}) == "crossing");
  CHECK(terrain_under(world, {14.5, 3}, 0) == "floor");
  CHECK(terrain_under(world, {14.62, 3}, 0) == "crossing, floor");  // its nose, 0.39 m ahead
  CHECK(terrain_under(world, {14.62, 3}, 1.5708) == "floor");
  CHECK(terrain_under(world, {14.65, 5.6}, 0.7) == "floor, street");  // a corner
  CHECK_FALSE(collides(world, {18, 3}, 0.48));                        // a patch is in nobody's way
}

TEST_CASE("who walks is where his pace says, looks ahead and stays where the way ends") {
  const auto simulation = town();
  const auto guide = [&](double seconds) { return *simulation->position("guide", at_s(seconds)); };
  CHECK((guide(69.9) - Vec2(13.6, 1.0)).norm() < 1e-9);
  CHECK((guide(125.05) - Vec2(14.3 + 0.6 * 5, 3.25)).norm() < 1e-6);  // 100 ms a piece
  CHECK((guide(136.5) - Vec2(23.4, 3.25)).norm() < 1e-6);
  CHECK((guide(500) - Vec2(24.0, 0.9)).norm() < 1e-6);
  const auto object = simulation->stage().states().object("guide");
  REQUIRE(object.has_value());
  CHECK(std::abs(simulation->stage().placed(*object, at_s(125))->yaw_rad) < 1e-9);
}

TEST_CASE("a shirt is drawn before the chest and on the back") {
  const auto simulation = town();
  Snapshot snapshot = simulation->make_snapshot();
  simulation->look(at_s(125), snapshot);
  int shirts = 0;
  for (const Quad& quad : snapshot.scene.quads) {
    if (!quad.picture) continue;
    ++shirts;
    CHECK(std::abs(std::abs(quad.normal.x()) - 1) < 1e-9);  // he walks along x
    CHECK((quad.corner[1] - quad.corner[0]).norm() == doctest::Approx(kShirtEdge * 1.80 / 1.75));
  }
  CHECK(shirts == 2);
}
