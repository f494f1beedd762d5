// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "nodes/semantic/status_line.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/requests.hpp"
#include "rt/testing.hpp"

using namespace takt;
using namespace takt::semantic;

namespace {

Request request(const char* id, uint8_t run, uint8_t every) {
  Request r;
  std::string(id).copy(r.node, sizeof(r.node) - 1);
  r.run = run, r.every = every;
  return r;
}

/// 20 x 20 free cells of 0.2 m around the robot.
struct Floor {
  test::Box<Grid> grid{{20, 20, 1, 0}};
  Floor() {
    grid->width = grid->height = 20;
    grid->cell_m = 0.2;
    grid->origin_x_m = grid->origin_y_m = -2;
    grid->cells.resize(400);
    for (auto& c : grid->cells.items()) c = 0;
  }
  void set(double x, double y, int16_t value) {
    grid->view().at(static_cast<int>((x + 2) / 0.2), static_cast<int>((y + 2) / 0.2)) = value;
  }
};

}  // namespace

TEST_CASE("the free way ends at the nearest occupied cell of the strip ahead") {
  Floor f;
  CHECK_FALSE(free_way_m(*f.grid, 0.8).has_value());
  f.set(0.7, 0.5, 1000);   // beside the strip
  f.set(0.1, -0.9, 1000);  // behind
  f.set(0.1, 0.9, Grid::unknown);
  f.set(-0.1, 0.7, 500);  // as likely free as not
  CHECK_FALSE(free_way_m(*f.grid, 0.8).has_value());
  f.set(-0.3, 1.7, 1000);
  CHECK(free_way_m(*f.grid, 0.8).value() == doctest::Approx(1.6));
  f.set(0.3, 1.1, 501);
  CHECK(free_way_m(*f.grid, 0.8).value() == doctest::Approx(1.0));
  CHECK(free_way_m(*f.grid, 0.3).has_value() == false);
  CHECK(free_way_m(*f.grid, 1.5).value() == doctest::Approx(0.4));
  f.set(0.1, 0.1, 1000);
  CHECK(free_way_m(*f.grid, 0.8).value() == 0);
}

TEST_CASE("the status is one line, and is cut off where it does not fit") {
  char memory[200];
  CHECK(write_status({}, memory) == "all nodes at full rate");
  const Request requests[] = {request("a", 0, 1), request("b", 1, 3), request("c", 0, 2)};
  Status status{stop_reason::obstacle | stop_reason::line_lost | stop_reason::safe_stop, false, requests, 4, 1.26, 0.0};
  const std::string whole =
      "robot stopped: obstacle, line lost, safe stop | stopped: a, c | paced: b/3 | objects: 4 | obstacle ahead: 1.3 m "
      "| ground "
      "ends ahead: 0.0 m";
  CHECK(write_status(status, memory) == whole);
  for (const size_t size : {0u, 1u, 20u, 60u})
    CHECK(write_status(status, std::span(memory).first(size)) == whole.substr(0, size));
  CHECK(write_status({0, true, {}, 0, {}, {}}, memory) == "robot stopped: no stop command | objects: 0");
}
