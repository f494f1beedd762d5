// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "hal/sim/sensors.hpp"
#include "nodes/semantic/network_file.hpp"
#include "tests/graph_folder.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;
using takt::test::has;
using takt::test::TemporaryFolder;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
const std::string kRows = "<rows>\n#######\n#.....#\n#.....#\n#.....#\n#.....#\n#######\n</rows>";

std::string message(const std::string& xml) {
  const TemporaryFolder folder;
  const auto world = load_world("camera", folder.write("world.xml", xml));
  return world ? "" : world.error().what + " | " + world.error().fix;
}

}  // namespace

TEST_CASE("a world with rows loads; row 0 of the bitmap is the bottom") {
  const TemporaryFolder folder;
  const auto file = folder.write("w.xml",
                                 "<world resolution=\"0.5m\"><rows>\n#####\n#.###\n#...#\n#...#\n#####\n</rows>"
                                 "<client name=\"ace\" x=\"1.2m\" y=\"1m\"/>"
                                 "<action name=\"fill\" cost=\"4s\"><role name=\"v\" type=\"cup\"/><post role=\"v\" "
                                 "attr=\"content\" value=\"full\"/></action></world>");
  const auto world = load_world("camera", file);
  REQUIRE(world.has_value());
  CHECK(world->map.at(2, 3));
  CHECK_FALSE(world->map.at(1, 3));
  CHECK_FALSE(world->map.at(3, 1));
  CHECK(world->map.at(-1, 2));
  CHECK(world->actions.at(0).post.at(0).value == "full");
}

TEST_CASE("mistakes in a world are told with file, line and the way out") {
  CHECK(has(message("<world"), "world.xml:1"));
  CHECK(has(message("<map/>"), "not <world>"));
  CHECK(has(message("<world resolution=\"0.5\">" + kRows + "</world>"), "m, cm or mm"));
  CHECK(has(message("<world resolution=\"0.5m\">" + kRows + "</world>"), "no <client>"));
  CHECK(has(message("<world resolution=\"0.5m\">" + kRows + "\n<robot/></world>"),
            "client, object, terrain, line, action"));
  CHECK(has(message("<world resolution=\"0.5m\" wall=\"marble\">" + kRows + "</world>"), "plaster"));
  CHECK(has(message("<world resolution=\"0.5m\"><rows>###\n#.\n###</rows></world>"), "row 2"));
  CHECK(has(message("<world resolution=\"0.5m\" map=\"absent.pgm\"/>"), "absent.pgm"));
  CHECK(has(message("<world resolution=\"0.5m\">" + kRows + "<client name=\"ace\" x=\"0.1m\" y=\"1m\"/></world>"),
            "inside an obstacle"));
  const auto missing = load_world("camera", "/nonexistent/world.xml");
  REQUIRE_FALSE(missing.has_value());
  CHECK(missing.error().id == "camera");
  CHECK(has(missing.error().what, "/nonexistent/world.xml"));
}

TEST_CASE("mistakes in what can change are told with file, line and what is valid") {
  const auto told = [](const std::string& element) {
    return message(
        "<world resolution=\"0.5m\">" + kRows +
        "<client name=\"ace\" x=\"1m\" y=\"1m\"/>\n"
        "<object name=\"cup\" type=\"cup\" x=\"2m\" y=\"1m\"><attr name=\"level\" value=\"full\"/></object>\n" +
        element + "</world>");
  };
  const auto about_cup = [&](const std::string& parts) {
    return told("<action name=\"drink\" cost=\"1s\"><role name=\"c\" type=\"cup\"/><role name=\"j\" type=\"jug\"/>" +
                parts + "</action>");
  };
  const auto looking = [&](const std::string& look) {
    return told("<object name=\"jug\" type=\"jug\" x=\"2m\" y=\"2m\"><attr name=\"closed\" value=\"true\"/>" + look +
                "</object>");
  };
  CHECK(told("") == "");
  CHECK(has(told("<event at=\"1s\" object=\"jar\" to=\"away\"/>"), "world.xml:10: no object `jar` | known: cup"));
  CHECK(has(told("<event at=\"1s\" object=\"cup\" attr=\"lid\" value=\"on\"/>"), "no attribute `lid` | known: level"));
  CHECK(has(told("<event at=\"1s\" object=\"cup\" to=\"table\"/>"), "use away"));
  CHECK(has(told("<event at=\"1s\" object=\"cup\"/>"), "give attr and value, x and y, or to=\"away\""));
  CHECK(has(told("<event at=\"1s\" object=\"cup\" x=\"1m\"/>"), "lacks `y`"));
  CHECK(has(told("<event at=\"-1s\" object=\"cup\" to=\"away\"/>"), "`at` must lie"));
  CHECK(has(told("<client name=\"ace\" x=\"1m\" y=\"1m\"/>"), "client `ace` exists already"));
  CHECK(has(told("<object name=\"" + std::string(32, 'x') + "\" type=\"cup\" x=\"2m\" y=\"1m\"/>"), "has 32 letters"));
  CHECK(about_cup("<pre role=\"c\" attr=\"level\" value=\"full\"/><move role=\"c\" to=\"j\"/>") == "");
  CHECK(has(about_cup("<pre role=\"c\" attr=\"lid\" value=\"on\"/>"), "no cup has an attribute `lid` | known: level"));
  CHECK(has(about_cup("<post role=\"x\" attr=\"level\" value=\"on\"/>"), "no role `x` | known: c, j"));
  CHECK(has(about_cup("<move role=\"c\" to=\"floor\"/>"), "use robot, away or another role: c, j"));
  CHECK(has(about_cup("<move role=\"c\" to=\"j\"/><move role=\"j\" to=\"robot\"/>"), "make them two actions"));
  CHECK(has(about_cup("<effect/>"), "known here: role, pre, post, move"));
  CHECK(has(told("<action name=\"wait\" cost=\"1s\"/>"), "has 0 roles | give it 1 to 4"));
  CHECK(has(told("<action name=\"wait\" cost=\"1s\" reach=\"0m\"/>"), "`reach` must lie in (0, 100 m] | correct it"));
  CHECK(looking("<look when=\"closed=true\"><box width=\"1m\" depth=\"1m\" height=\"1m\"/></look>") == "");
  CHECK(has(looking("<look><box/></look>"), "lacks `when`"));
  CHECK(has(looking("<look when=\"closed\"/>"), "write attribute=value"));
  CHECK(has(looking("<look when=\"lid=on\"/>"), "object `jug` has no attribute `lid` | known: closed"));
  CHECK(has(looking("<look when=\"closed=true\"><attr/></look>"), "known here: box, person, board"));
}

TEST_CASE("the shipped worlds of the semantic robot load, and their objects can be reached") {
  const std::filesystem::path worlds = takt::test::graph_folder() / "worlds";
  struct Near {
    const char *world, *object;
    Vec2 robot;
  };
  for (const Near& near : {Near{"kitchen.xml", "cup_1", {3.5, 5.8}}, Near{"kitchen.xml", "bottle_1", {3.5, 5.8}},
                           Near{"kitchen.xml", "bottle_2", {9.5, 5.8}}, Near{"hoover.xml", "hoover_1", {3.8, 2.0}},
                           Near{"hoover.xml", "human_1", {4.35, 4.3}}, Near{"chairs.xml", "chair_2", {4.2, 4.5}}}) {
    CAPTURE(near.object);
    auto stage = Stage::load("world", worlds / near.world, 1);
    REQUIRE_MESSAGE(stage.has_value(), (stage ? "" : stage.error().text()));
    (*stage)->begin(0);
    const auto object = (*stage)->states().object(near.object);
    REQUIRE(object);
    CHECK_FALSE((*stage)->refuses(0, Vec2(1.5, 3.2), near.robot, 0));
    CHECK(distance_to(*(*stage)->placed(*object, 0), near.robot) < kReach);
  }
}

TEST_CASE("the kitchen has the types, attributes, actions and costs of the network that plans in it") {
  const std::filesystem::path graph = takt::test::graph_folder();
  const auto world = load_world("world", graph / "worlds/kitchen.xml");
  REQUIRE(world.has_value());
  semantic::SemanticMap map({});
  REQUIRE(semantic::read_network(graph / "networks/kitchen.yaml", map).has_value());
  const semantic::Network& network = map.network();
  CHECK(map.all(semantic::Kind::action).size() == world->actions.size());
  for (const WorldAction& action : world->actions) {
    CAPTURE(action.name);
    const semantic::NodeId node = network.find(action.name);
    REQUIRE(node != semantic::kNoNode);
    const semantic::Action& known = map.action(node);
    CHECK(known.cost_s == action.cost_s);
    REQUIRE(known.roles.size() == action.roles.size());
    for (size_t i = 0; i < known.roles.size(); ++i) {
      CHECK(known.roles[i].name == action.roles[i].name);
      CHECK(network.name(known.roles[i].type) == action.roles[i].type);
    }
    const auto same = [&](const std::vector<semantic::Clause>& clauses, const std::vector<RoleCondition>& conditions) {
      REQUIRE(clauses.size() == conditions.size());
      for (const semantic::Clause& clause : clauses) {
        const auto found = std::find_if(conditions.begin(), conditions.end(), [&](const RoleCondition& condition) {
          return condition.role == known.roles[clause.role].name &&
                 condition.attribute == network.name(clause.attribute);
        });
        REQUIRE(found != conditions.end());
        CHECK(semantic::to_text(map.attribute(clause.attribute), clause.value) == found->value);
      }
    };
    same(known.required, action.pre);
    same(known.results, action.post);
  }
  for (const WorldObject& object : world->objects) {
    const semantic::NodeId type = network.find(object.type);
    if (type == semantic::kNoNode) continue;  // furniture
    for (const auto& [name, value] : object.attributes) {
      CAPTURE(name);
      const semantic::NodeId attribute = network.find(name);
      REQUIRE(attribute != semantic::kNoNode);
      CHECK(network.connected(type, attribute));
      CHECK(semantic::parse_value(map.attribute(attribute), value).has_value());
    }
  }
}

TEST_CASE("truncated and foreign maps are refused") {
  const TemporaryFolder folder;
  CHECK(load_pgm(folder.write("good.pgm", std::string("P5\n# comment\n3 3\n255\n") + std::string(9, '\xff')), 0.1)
            .has_value());
  CHECK_FALSE(
      load_pgm(folder.write("short.pgm", std::string("P5\n3 3\n255\n") + std::string(8, '\xff')), 0.1).has_value());
  CHECK_FALSE(load_pgm(folder.write("wide.pgm", "P5\n99999 3\n255\n"), 0.1).has_value());
  CHECK_FALSE(load_pgm(folder.write("text.pgm", "hello"), 0.1).has_value());
}

TEST_CASE("the shipped world and rigs load, and the drive is free, slow and smooth") {
  const std::filesystem::path graph = takt::test::graph_folder();
  const auto s = Simulation::load("camera", graph / "worlds/lab.xml", "", 1);
  REQUIRE_MESSAGE(s.has_value(), (s ? "" : s.error().text()));
  for (const char* rig : {"xb3.yaml", "xb3_fine.yaml", "xb3_raw.yaml", "x2_wide.yaml"}) {
    const auto loaded = load_rig("camera", graph / "rigs" / rig);
    CHECK_MESSAGE(loaded.has_value(), (loaded ? "" : loaded.error().text()));
  }
  (*s)->begin(0);
  RobotState previous = (*s)->robot(0);
  CHECK(previous.speed_m_s == 0.0);
  for (int64_t k = 1; k < 20'000; ++k) {
    const RobotState now = (*s)->robot(k * 10'000'000);
    CHECK(now.speed_m_s <= 0.4 + 1e-9);
    CHECK(std::abs(now.turn_rad_s) <= 0.31);
    CHECK(std::abs(now.speed_m_s - previous.speed_m_s) <= 1.35 * 0.01);
    CHECK(std::abs(now.turn_rad_s - previous.turn_rad_s) <= 0.05);
    CHECK(std::hypot(now.x_m - previous.x_m, now.y_m - previous.y_m) <= 0.0041);
    CHECK_FALSE(collides((*s)->world(), Vec2(now.x_m, now.y_m), Simulation::kFootprintRadius));
    previous = now;
  }
}

TEST_CASE("speed and turn rate of the path are the derivatives of its pose") {
  const Path path(test::small_path());
  for (double t = 0.05; t < 40; t += 0.173) {
    const double h = 1e-4;
    const RobotState a = path.at(t - h), b = path.at(t + h), m = path.at(t);
    CHECK(std::hypot(b.x_m - a.x_m, b.y_m - a.y_m) / (2 * h) == doctest::Approx(m.speed_m_s).epsilon(0.02));
    CHECK(std::remainder(b.theta_rad - a.theta_rad, 6.283185307179586) / (2 * h) ==
          doctest::Approx(m.turn_rad_s).epsilon(0.05));
  }
}

TEST_CASE("an open path stops at its last waypoint") {
  PathRequest request = test::small_path();
  request.loop = false;
  const Path path(request);
  const RobotState end = path.at(1000);
  CHECK(end.x_m == doctest::Approx(1.7).epsilon(1e-3));
  CHECK(end.y_m == doctest::Approx(3.4).epsilon(1e-3));
  CHECK(end.speed_m_s == doctest::Approx(0.0));
}

TEST_CASE("laser: mean and spread of the range to a wall at a known distance") {
  const auto s = test::small_simulation();
  s->begin(0);
  std::vector<float> range(181);
  Snapshot met = s->make_snapshot();
  double sum = 0, squares = 0;
  const int n = 400;
  for (int k = 0; k < n; ++k) {
    scan(*s, {}, 20'000'000ll * k, range, met);
    const double r = static_cast<double>(range[180]);  // +90 degrees: the upper wall, 4.9 - 2.5 m away
    sum += r, squares += r * r;
  }
  CHECK(sum / n == doctest::Approx(2.4).epsilon(0.002));
  CHECK(std::sqrt(squares / n - sum * sum / n / n) == doctest::Approx(0.01).epsilon(0.2));
}

TEST_CASE("laser: a scanner tilted to the floor sees it at its distance, and the box on it") {
  const auto s = test::small_simulation();
  s->begin(0);
  LaserModel model;
  model.beams = 281, model.fov_rad = 70 * kDegree, model.max_range_m = 3, model.sigma_m = 0;
  model.sensor_in_robot.z = 1;
  model.sensor_in_robot.qw = std::cos(17 * kDegree), model.sensor_in_robot.qx = -std::sin(17 * kDegree);
  std::vector<float> range(model.beams);
  Snapshot met = s->make_snapshot();
  scan(*s, model, 0, range, met);
  for (const size_t beam : {size_t{0}, size_t{140}, size_t{280}}) {
    const double aside = (static_cast<double>(beam) - 140) * 0.25 * kDegree;
    CHECK(range[beam] == doctest::Approx(1 / std::sin(34 * kDegree) / std::cos(aside)));
  }
  model.sensor_in_robot.y = 1;  // the robot looks along x: the scanner at (2.5, 2.5), the box at (4.0, 3.2) before it
  scan(*s, model, 0, range, met);
  const double to_floor_m = 1 / std::sin(34 * kDegree) / std::cos(25 * kDegree);
  CHECK(range[240] > 0);
  CHECK(range[240] < to_floor_m - 0.05);
}

TEST_CASE("objects are seen only in the field of view and unhidden") {
  const auto s = test::small_simulation();
  s->begin(0);
  const auto seen = s->visible_objects(0);
  CHECK(seen.size() == 2);
  World turned = test::small_world();
  turned.clients[0].theta_rad = 3.14;
  Simulation away(std::move(turned), 0, 1);
  away.begin(0);
  CHECK(away.visible_objects(0).empty());
}
