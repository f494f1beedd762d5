// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/evaluate.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace takt::semantic;

TEST_CASE("without noise each object of a room becomes one node at its place, and those taken away go") {
  RoomParameters room;
  room.noise_m = 0, room.colour_noise = 0, room.height_noise_m = 0, room.spacing_m = 1.5, room.vanish = 12;
  const RoomFigures f = measure_rooms(room, {}, 1, 3);
  CHECK(f.seen > 45);
  CHECK(f.found == f.seen);
  CHECK(f.duplicates == 0);
  CHECK(f.false_merges == 0);
  CHECK(f.swallowed == 0);
  CHECK(f.wrongly_removed == 0);
  CHECK(f.vanished > 10);
  CHECK(f.removed == f.vanished);
  CHECK(*std::max_element(f.position_m.begin(), f.position_m.end()) < 1e-9);
}

TEST_CASE("with 0.3 m of noise attributes prevent false merges that places alone make") {
  const RoomFigures both = measure_rooms({}, {}, 1, 3), places = measure_rooms({}, {}, 1, 3, false);
  CHECK(both.found > both.seen * 9 / 10);
  CHECK(places.found < both.found);
  CHECK(places.swallowed > 2 * both.swallowed);
  CHECK(both.false_merges < both.sightings / 20);
}
