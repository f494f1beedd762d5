// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <numbers>
#include <string>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/semantic/report_message.hpp"

namespace takt {
void register_semantic_map(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr const char* kNetwork = R"(takt_network: 1
attributes: {colour: {kind: colour}, height: {kind: scalar, range: [0m, 3m]}}
types: {chair: {attributes: [colour, height]}, table: {attributes: [height]}}
objects: {sofa: {type: chair, at: [20m, 20m], states: {height: 1m}}}
)";

struct MapFixture {
  VirtualClock clock;
  test::TemporaryFolder folder;
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<Objects3d>> objects;
  std::unique_ptr<test::BoxWriter<ObjectReports>> reports;
  std::unique_ptr<test::BoxWriter<TextStatus>> decisions;
  test::Box<Objects3d> things{{0, 0, 1, 8}};
  test::Box<ObjectReports> seen{{0, 0, 1, 8}};
  test::Box<Odometry> odometry;
  test::Box<Grid> grid{{60, 60, 1, 0}};
  uint64_t jobs = 0;

  explicit MapFixture(const std::string& network = kNetwork, const std::string& classes = "chair, table") {
    NodeTypes types;
    register_semantic_map(types);
    REQUIRE(types.find("semantic_map")->layer == Layer::storage);
    node = types.find("semantic_map")->make();
    folder.write("n.yaml", network);
    test::set(*node, "network", std::string("n.yaml"));
    test::set(*node, "classes", classes);
    test::set(*node, "misses", int64_t{2});
    PortAccess::connect(test::input(*node, "things"), {0, 0, 1, 8});
    PortAccess::connect(test::input(*node, "reports"), {0, 0, 1, 8});
    PortAccess::connect(test::input(*node, "odometry"), {});
    PortAccess::connect(test::input(*node, "grid"), {60, 60, 1, 0});
    PortAccess::connect(test::input(*node, "terrain"), {});
  }
  void set_up() {
    Setup setup{clock, folder.path, folder.path, 0, std::nullopt, 0};
    node->setup(setup);
    objects = std::make_unique<test::BoxWriter<Objects3d>>(*node->outputs()[0]);
    reports = std::make_unique<test::BoxWriter<ObjectReports>>(*node->outputs()[1]);
    decisions = std::make_unique<test::BoxWriter<TextStatus>>(*node->outputs()[2]);
  }
  /// 12 m x 12 m around the origin.
  void free_grid() {
    grid->width = grid->height = 60;
    grid->cell_m = 0.2;
    grid->origin_x_m = grid->origin_y_m = -6;
    grid->cells.resize(3600);
    for (int16_t& cell : grid->cells.items()) cell = 0;
    test::latch(test::input(*node, "grid"), grid, 1, 1);
  }
  void thing(float class_id, float x_m, float y_m, float red = 0) {
    Object3d o{};
    o.class_id = class_id, o.score = 0.9F, o.x_m = x_m, o.y_m = y_m, o.red = red, o.height_m = 0.9F;
    things->objects.push_back(o);
  }
  /// What is decided about things and reports, seen from there at once; they are forgotten by this function.
  std::string job(double x_m, double y_m, double theta_rad, bool pose_known = true) {
    const int64_t stamp = 100'000'000 * static_cast<int64_t>(++jobs);
    odometry->x_m = x_m, odometry->y_m = y_m, odometry->theta_rad = theta_rad;
    test::latch(test::input(*node, "things"), things, stamp, jobs);
    if (!seen->names.empty()) test::latch(test::input(*node, "reports"), seen, stamp, jobs);
    if (pose_known) test::latch(test::input(*node, "odometry"), odometry, stamp, jobs);
    objects->clear(), reports->clear(), decisions->clear();
    Job job(clock, jobs, stamp, stamp + 66'000'000, 0, "full");
    const uint64_t before = thread_memory_use().allocations;
    node->run(job);
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    things->objects.resize(0);
    seen->names.resize(0), seen->places.resize(0), seen->attributes.resize(0);
    CHECK(objects->sent() == pose_known);
    CHECK(reports->sent() == pose_known);
    CHECK(decisions->sent() == pose_known);
    if (!pose_known) return "";
    CHECK(objects->stamp_ns() == stamp);
    const auto text = decisions->message().text.items();
    return {text.begin(), text.end()};
  }
  /// Chairs and tables; the sofa, which the network's file places, comes first.
  std::span<const Object3d> known() { return objects->message().objects.items().subspan(1); }
};

constexpr double kQuarter = std::numbers::pi / 2;

}  // namespace

TEST_CASE("semantic_map places what is seen in the map, and knows it again from elsewhere") {
  MapFixture f;
  f.set_up();
  f.thing(0, 0.5F, 2, 200);
  f.thing(1, -1, 3);
  f.thing(-1, 0, 1);
  CHECK(f.job(2, 1, kQuarter) ==
        "created chair_1: none of its type within 2 m\ncreated table_1: none of its type within 2 m");
  REQUIRE(f.known().size() == 2);
  CHECK(f.known()[0].class_id == 0);
  CHECK(f.known()[0].x_m == doctest::Approx(2.5));
  CHECK(f.known()[0].y_m == doctest::Approx(3));
  CHECK(f.known()[0].red == doctest::Approx(200));
  CHECK(f.known()[0].height_m == doctest::Approx(0.9));
  CHECK(f.known()[1].class_id == 1);
  CHECK(f.known()[1].x_m == doctest::Approx(1));
  CHECK(f.known()[1].y_m == doctest::Approx(4));
  // From (0.5, 3), driving along x: the chair is 2 m ahead.
  f.thing(0, 0.4F, 2, 200);
  CHECK(f.job(0.5, 3, 0) == "merged with chair_1, p = 0.98 >= 0.75: 0.40 m apart");
  CHECK(f.known().size() == 2);
  CHECK(f.known()[0].y_m == doctest::Approx(2.8));
}

TEST_CASE("semantic_map waits for the robot's pose at the stamp") {
  MapFixture f;
  f.set_up();
  f.thing(0, 0, 2);
  f.job(0, 0, 0, false);
  f.thing(0, 0, 2);
  CHECK(f.job(0, 0, 0) == "created chair_1: none of its type within 2 m");
}

TEST_CASE("semantic_map removes an object whose place a grid shows free in two looks") {
  MapFixture f;
  f.set_up();
  f.free_grid();
  f.thing(0, 0, 2);
  f.job(0, 0, 0);
  CHECK(f.job(0, 0, 0) == "");
  CHECK(f.job(0, 0, kQuarter) == "");  // looks elsewhere
  f.things->searched = 0.5;
  CHECK(f.job(0, 0, 0) == "");
  f.things->searched = 1;
  CHECK(f.job(0, 0, 0) == "removed chair_1: its place was seen free 2 times in a row, after 1 sightings");
  CHECK(f.known().empty());
}

TEST_CASE("semantic_map misses what the head looks at, wherever the robot drives") {
  MapFixture f;
  PortAccess::connect(test::input(*f.node, "head"), {});
  f.set_up();
  test::Box<HeadState> head;
  const auto look = [&](double pan_rad) {
    head->pan_rad = pan_rad;
    test::latch(test::input(*f.node, "head"), head, 100'000'000 * static_cast<int64_t>(f.jobs + 1), f.jobs + 1);
    return f.job(0, 0, 0);
  };
  f.free_grid();
  f.thing(0, 0, 2);
  look(0);
  CHECK(look(kQuarter) == "");
  CHECK(look(kQuarter) == "");
  CHECK(f.job(0, 0, 0) == "");  // it has not moved since
  look(0);
  CHECK(look(0) == "removed chair_1: its place was seen free 2 times in a row, after 1 sightings");
}

TEST_CASE("semantic_map keeps terrain at the place where it was seen, and tells where it is another") {
  MapFixture f;
  f.set_up();
  test::Box<takt::Terrain> terrain;
  const auto on = [&](uint8_t kind, double x_m) {
    terrain->kind = kind;
    test::latch(test::input(*f.node, "terrain"), terrain, 100'000'000 * static_cast<int64_t>(f.jobs + 1), f.jobs + 1);
    return f.job(x_m, 1, 0);
  };
  CHECK(on(terrain_kind::left, 2.1) == "terrain at (2.1 m, 1.0 m): left, was unknown");
  CHECK(on(terrain_kind::left, 2.1) == "");
  CHECK(on(terrain_kind::unknown, 2.1) == "");
  CHECK(on(terrain_kind::crossing, 5) == "terrain at (5.0 m, 1.0 m): crossing, was unknown");
  CHECK(on(terrain_kind::crossing, 2.1) == "terrain at (2.1 m, 1.0 m): crossing, was left");
}

TEST_CASE("semantic_map keeps what is reported by type and name, with its states as text") {
  MapFixture f;
  f.set_up();
  test::add_report(*f.seen, "", "chair", 0.5F, 2, {{"colour", "0.5 0.25 0"}});
  test::add_report(*f.seen, "hers", "table", -1, 3, {{"height", "0.7m"}, {"legs", "4"}});
  test::add_report(*f.seen, "", "lamp", 1, 1);
  CHECK(f.job(2, 1, kQuarter) ==
        "created chair_1: none of its type within 2 m\n"
        "left out legs of a table, no attribute of the network: 1 such so far\n"
        "created hers: nothing had its name\n"
        "left out a `lamp`, no type of the network: 1 such so far");
  std::string told;
  semantic::for_each_report(f.reports->message(), [&](const semantic::Report& report) {
    told += std::string(report.name) + " " + std::string(report.type);
    for (const ObjectAttribute& said : report.attributes) told += std::string(" ") + said.name + "=" + said.value;
    told += "\n";
  });
  CHECK(told == "sofa chair height=1m\nchair_1 chair colour=0.5 0.25 0\nhers table height=0.7m\n");
  CHECK(f.reports->message().in_map == 1);
  CHECK(f.reports->message().places[1].x_m == doctest::Approx(2.5));
  // From elsewhere: the chair is known again by its type and place, the table by its name, which was carried away.
  test::add_report(*f.seen, "", "chair", 0.4F, 2);
  test::add_report(*f.seen, "hers", "table", 3, 2);
  test::add_report(*f.seen, "", "lamp", 1, 1);
  CHECK(f.job(0.5, 3, 0) ==
        "merged with chair_1, p = 0.98 >= 0.75: 0.40 m apart\n"
        "merged with hers, which has its name: 4.27 m apart\n"
        "left out a `lamp`, no type of the network: 2 such so far");
  CHECK(f.reports->message().places[2].x_m == doctest::Approx(2.5));
  CHECK(f.reports->message().places[2].y_m == doctest::Approx(0));
}

TEST_CASE("semantic_map goes on after a restart with what it published last") {
  MapFixture first;
  first.set_up();
  test::add_report(*first.seen, "", "chair", 0.5F, 2, {{"height", "0.9m"}});
  test::add_report(*first.seen, "sofa", "chair", 1, 2);  // it stands elsewhere than the network's file says
  first.job(0, 0, kQuarter);
  MapFixture second;
  second.set_up();
  PortAccess::hand_over(*second.node->outputs()[1], &first.reports->message());
  second.node->start(0);
  CHECK(second.job(0, 0, kQuarter) == "");
  const ObjectReports &before = first.reports->message(), &after = second.reports->message();
  REQUIRE(before.names.size == 2);
  REQUIRE(after.names.size == 2);
  const auto find = [](const ObjectReports& reports, std::string_view name) {
    std::string all;
    semantic::for_each_report(reports, [&](const semantic::Report& r) {
      if (r.name != name) return;
      all = std::string(r.type) + " " + std::to_string(r.place.x_m) + " " + std::to_string(r.place.y_m);
      for (const ObjectAttribute& said : r.attributes) all += std::string(" ") + said.name + "=" + said.value;
    });
    return all;
  };
  for (const char* name : {"sofa", "chair_1"}) CHECK(find(before, name) == find(after, name));
  CHECK(find(after, "sofa").find("height=1m") != std::string::npos);
}

TEST_CASE("semantic_map needs things or reports") {
  NodeTypes types;
  register_semantic_map(types);
  const auto node = types.find("semantic_map")->make();
  CHECK_THROWS_WITH_AS(test::set_up(*node), "connect `things` or `reports`, or both", SetupError);
}

TEST_CASE("semantic_map refuses networks and classes that it cannot read") {
  MapFixture network("takt_network: 1\ntypes: {chair: {attributes: [size]}}\n");
  CHECK_THROWS_WITH_AS(network.set_up(),
                       doctest::Contains("n.yaml:2:30: there is no attribute `size`; valid are: (none)"), SetupError);
  MapFixture classes(kNetwork, "chair, colour");
  CHECK_THROWS_WITH_AS(classes.set_up(), "classes: `colour`: another node has this name", SetupError);
}
