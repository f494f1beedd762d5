// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "nodes/ground_map/floor_projection.hpp"
#include "nodes/ground_map/terrain_file.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "rt/transform/pose_math.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/ground_map/camera.hpp"

namespace takt {
void register_ground_map(NodeTypes& types);
}

using namespace takt;
using test::kCamera, test::kHeight, test::kWidth;

namespace {

constexpr Capacity kImage{kWidth, kHeight, 3, 0};
using test::kMs;

/// A floor of one colour; what lies beyond wall_y_m ahead of the robot has another.
struct FloorPair : test::Box<StereoPair> {
  explicit FloorPair(double wall_y_m, uint8_t floor_value = 140) : Box(kImage) {
    StereoPair& pair = **this;
    pair.width = kWidth;
    pair.height = kHeight;
    pair.channels = 3;
    pair.camera = kCamera;
    pair.sensor_in_robot = mapping_3d::camera_mount(0, 0, 1.2, 0, -0.45);
    pair.left.resize(static_cast<size_t>(kWidth * kHeight * 3));
    pair.right.resize(pair.left.size);
    const auto projection = ground_map::floor_projection(pair.camera, pair.sensor_in_robot);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto p = projection.floor_at(x, y);
        const bool floor = p && p->y_m < wall_y_m;
        uint8_t* pixel = &pair.left_view().at(x, y);
        pixel[0] = floor ? static_cast<uint8_t>(floor_value / 2) : uint8_t{200};
        pixel[1] = pixel[2] = static_cast<uint8_t>(floor ? floor_value : 60);
      }
  }
};

/// The node with the inputs that a test names connected, and both outputs read.
struct Bench {
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<Image>> mask;
  std::unique_ptr<test::BoxWriter<Grid>> grid;

  explicit Bench(std::initializer_list<const char*> connected = {}, std::string_view motion_camera = "same") {
    NodeTypes types;
    register_ground_map(types);
    node = types.find("ground_map")->make();
    test::set(*node, "motion_camera", std::string(motion_camera));
    PortAccess::connect(port("pair"), kImage);
    for (const char* name : connected) PortAccess::connect(port(name), {0, 0, 1, 181});
    test::set_up(*node);
    mask = std::make_unique<test::BoxWriter<Image>>(*node->outputs()[0]);
    grid = std::make_unique<test::BoxWriter<Grid>>(*node->outputs()[1]);
  }
  InputPort& port(std::string_view name) { return test::input(*node, name); }
  bool run() {
    mask->clear();
    grid->clear();
    return test::run(*node);
  }
  int16_t cell(double x_in_map, double y_in_map) {
    Grid& g = grid->message();
    return g.view().at(static_cast<int>(std::floor((x_in_map - g.grid_in_map.x - g.origin_x_m) / g.cell_m)),
                       static_cast<int>(std::floor((y_in_map - g.grid_in_map.y - g.origin_y_m) / g.cell_m)));
  }
  uint8_t mask_at(int x, int y) { return mask->message().view().at(x, y); }
};

}  // namespace

TEST_CASE("ground_map: mask and robot-fixed grid of one image where no pose is connected") {
  Bench bench;
  CHECK_FALSE(bench.run());  // nothing latched
  FloorPair first(3.1), second(2.2);
  test::latch(bench.port("pair"), first, 100, 1);
  CHECK(bench.run());
  REQUIRE(bench.mask->sent());
  REQUIRE(bench.grid->sent());
  CHECK(bench.mask->stamp_ns() == 100);
  CHECK(bench.grid->stamp_ns() == 100);
  CHECK(bench.mask->message().channels == 1);
  CHECK(bench.mask->message().camera.focal_px == 141.5);
  CHECK(bench.mask_at(160, 230) == 255);
  CHECK(bench.mask_at(160, 10) == 0);
  CHECK(bench.grid->message().grid_in_map.x == 0);
  CHECK(bench.cell(0.1, 2.5) == 0);
  CHECK(bench.cell(0.1, 3.1) == 1000);
  CHECK(bench.cell(0.1, 4.5) == Grid::unknown);

  CHECK_FALSE(bench.run());  // the same image again
  CHECK_FALSE(bench.mask->sent());

  test::latch(bench.port("pair"), second, 200, 2);
  CHECK(bench.run());
  CHECK(bench.cell(0.1, 2.3) == 1000);
  CHECK(bench.cell(0.1, 3.1) == Grid::unknown);  // what an earlier image showed is not mixed in
}

TEST_CASE("ground_map: images it cannot use give no result") {
  Bench bench;
  FloorPair raw(3), small(3);
  raw->camera = {};
  test::latch(bench.port("pair"), raw, 100, 1);
  CHECK_FALSE(bench.run());
  small->width = kWidth / 2;
  test::latch(bench.port("pair"), small, 200, 2);
  CHECK_FALSE(bench.run());
  FloorPair cut(3);
  cut->left.size -= 1;
  test::latch(bench.port("pair"), cut, 300, 3);
  CHECK_FALSE(bench.run());
  CHECK_FALSE(bench.mask->sent());
  CHECK_FALSE(bench.grid->sent());
}

TEST_CASE("ground_map: a frame that the camera calls bad teaches nothing, but is classified") {
  for (const uint32_t bad : {image_health::saturated, image_health::dark, image_health::blurred}) {
    Bench bench;
    FloorPair known(3), other(3, 70);
    other->health = bad;
    test::latch(bench.port("pair"), other, 100, 1);
    CHECK(bench.run());
    CHECK(bench.mask_at(160, 230) == 0);           // nothing learnt yet, so nothing is ground ...
    CHECK(bench.cell(0.1, 2.5) == Grid::unknown);  // ... which says nothing about obstacles
    CHECK(bench.mask->message().health == bad);
    test::latch(bench.port("pair"), known, 200, 2);
    CHECK(bench.run());
    CHECK(bench.mask_at(160, 230) == 255);
    test::latch(bench.port("pair"), other, 300, 3);
    CHECK(bench.run());
    CHECK(bench.mask_at(160, 230) == 0);
    other->health = image_health::partial;  // not one of the three
    test::latch(bench.port("pair"), other, 400, 4);
    CHECK(bench.run());
    CHECK(bench.mask_at(160, 230) == 255);
  }
}

TEST_CASE("ground_map: with a laser it learns only where a scan of the same time shows the reference area free") {
  test::Box<LaserScan> scan({0, 0, 1, 181});
  scan->first_angle_rad = -std::numbers::pi / 2;
  scan->step_rad = std::numbers::pi / 180;
  scan->max_range_m = 8;
  scan->sensor_in_robot = {0, 0.3, 0.25, 1, 0, 0, 0};
  scan->range_m.resize(181);
  FloorPair pair(3);
  const auto in_area = ground_map::floor_projection(pair->camera, pair->sensor_in_robot).floor_at(160, 210);
  const auto learnt = [&](float range_ahead, int64_t scan_stamp_ns, bool latched = true) {
    Bench bench({"scan"});
    std::fill_n(scan->range_m.data(), 181, 0.0f);
    scan->range_m[90] = range_ahead;
    if (latched) test::latch(bench.port("scan"), scan, scan_stamp_ns, 1);
    test::latch(bench.port("pair"), pair, 1000 * kMs, 1);
    CHECK(bench.run());
    return bench.mask_at(160, 230) == 255;
  };
  CHECK(learnt(0, 950 * kMs));
  CHECK(learnt(7, 1100 * kMs));
  CHECK_FALSE(learnt(static_cast<float>(in_area->y_m - 0.3), 950 * kMs));
  CHECK_FALSE(learnt(0, 700 * kMs));  // too old to speak for this image
  CHECK_FALSE(learnt(0, 0, false));   // a silent scanner
}

TEST_CASE("ground_map: the camera looks where the head turned it; where that is not known only the mask is given") {
  Bench bench({"head"});
  FloorPair pair(3.1);
  const Transform looking_left = mapping_3d::turned_by_head(pair->sensor_in_robot, 0.5, 0);
  const auto at = ground_map::floor_projection(pair->camera, looking_left).floor_at(160, 120);
  REQUIRE(at.has_value());
  test::Box<HeadState> rest, turned;
  turned->pan_rad = 1;
  rest->moving = turned->moving = 1;
  test::latch(bench.port("pair"), pair, 100 * kMs, 1);
  CHECK(bench.run());
  CHECK(bench.mask->sent());
  CHECK_FALSE(bench.grid->sent());  // the head has not said anything
  test::latch(bench.port("head"), rest, 100 * kMs, 1, 0);
  test::latch(bench.port("pair"), pair, 150 * kMs, 2);
  CHECK(bench.run());
  CHECK_FALSE(bench.grid->sent());  // it was moving, and it is not known where to
  test::latch(bench.port("head"), turned, 200 * kMs, 2, 1);
  test::latch(bench.port("pair"), pair, 151 * kMs, 3);
  CHECK(bench.run());
  REQUIRE(bench.grid->sent());
  // About half way, 0.51 rad to the left, so what the middle of the image shows lies there.
  CHECK(at->x_m < -0.5);
  CHECK(bench.cell(at->x_m * 0.8, at->y_m * 0.8) == 0);
  CHECK(bench.cell(-at->x_m * 1.2, at->y_m * 1.2) == Grid::unknown);
  turned->moving = 0;
  test::latch(bench.port("pair"), pair, 400 * kMs, 4);  // it stands since 200 ms
  CHECK(bench.run());
  CHECK(bench.grid->sent());
  test::latch(bench.port("pair"), pair, 1200 * kMs, 5);  // silent for too long
  CHECK(bench.run());
  CHECK_FALSE(bench.grid->sent());
}

TEST_CASE("ground_map: the confidence of each pixel, and the kind of terrain from learnt maps") {
  const test::TemporaryFolder folder;
  std::ofstream maps(folder.path / "terrain.txt");
  const ground_map::TerrainShape shape{8, 8, 4, 0, 0.3};
  ground_map::write_terrain_shape(maps, shape);
  for (size_t kind = 0; kind < ground_map::kTerrainKinds; ++kind)
    ground_map::write_terrain_map(maps, shape, kind,
                                  std::vector<int16_t>(64, kind == terrain_kind::crossing ? 0 : 1000));
  maps.close();
  NodeTypes types;
  register_ground_map(types);
  const auto node = types.find("ground_map")->make();
  test::set(*node, "terrain_maps", (folder.path / "terrain.txt").string());
  PortAccess::connect(test::input(*node, "pair"), kImage);
  test::set_up(*node);
  test::BoxWriter<Image> confidence(*node->outputs()[3]);
  test::BoxWriter<Terrain> terrain(*node->outputs()[4]);
  test::BoxWriter<Grid> around(*node->outputs()[5]);
  FloorPair pair(9);
  pair->left_view().at(10, 10, 0) = pair->left_view().at(10, 10, 1) = 255;
  for (int job = 1; job <= 4; ++job) {
    test::latch(test::input(*node, "pair"), pair, job * 200 * kMs, static_cast<uint64_t>(job));
    confidence.clear();
    terrain.clear();
    around.clear();
    CHECK(test::run(*node));
    REQUIRE(confidence.sent());
    REQUIRE(terrain.sent());
    CHECK(terrain.message().kind == (job < 4 ? terrain_kind::unknown : terrain_kind::crossing));
    CHECK(terrain.stamp_ns() == job * 200 * kMs);
  }
  CHECK(around.message().view().at(4, 7) == 0);   // ahead
  CHECK(around.message().view().at(0, 0) == -1);  // beside the robot, where the camera does not look
  CHECK(around.message().origin_x_m == doctest::Approx(-1.2));
  // The other cells, which it does not know, do not count.
  CHECK(terrain.message().correlations[terrain_kind::crossing] == doctest::Approx(1));
  CHECK(terrain.message().correlations[terrain_kind::left] == doctest::Approx(-1));
  CHECK(confidence.message().view().at(160, 230) == 255);
  CHECK(confidence.message().view().at(10, 10) == 64);  // as if flooded
}

TEST_CASE("ground_map: odometry moves the window, and cells stay where they are in the map (C-9)") {
  Bench bench({"odometry"});
  FloorPair pair(3.1), nearer(2.1);
  test::Box<Odometry> a, b;
  a->theta_rad = b->theta_rad = 0;  // driving along the map's x axis
  b->x_m = 2;
  test::latch(bench.port("pair"), pair, 100 * kMs, 1);
  CHECK(bench.run());
  CHECK(bench.mask->sent());  // a mask needs no pose
  CHECK_FALSE(bench.grid->sent());

  test::latch(bench.port("odometry"), a, 100 * kMs, 1, 0);
  test::latch(bench.port("odometry"), b, 300 * kMs, 2, 1);
  test::latch(bench.port("pair"), nearer, 200 * kMs, 2);  // at x = 1, between the two
  CHECK(bench.run());
  REQUIRE(bench.grid->sent());
  CHECK(bench.grid->stamp_ns() == 200 * kMs);
  CHECK(bench.cell(1 + 2.2, 0.1) == 700);
  CHECK(bench.cell(1 + 1.5, 0.1) == 400);
  const Transform window = bench.grid->message().grid_in_map;
  CHECK(window.qw == 1);
  CHECK(window.x <= 1);
  CHECK(window.x > 0.7);

  test::latch(bench.port("pair"), pair, 350 * kMs, 3);  // predicted: x = 2.5, the wall at 5.6
  CHECK(bench.run());
  REQUIRE(bench.grid->sent());
  CHECK(bench.cell(5.55, 0.1) == 700);
  CHECK(bench.cell(1 + 1.5, 0.1) != Grid::unknown);      // seen before, and still there
  test::latch(bench.port("pair"), pair, 2000 * kMs, 4);  // too far ahead of all poses
  CHECK(bench.run());
  CHECK(bench.mask->sent());
  CHECK_FALSE(bench.grid->sent());
}

TEST_CASE("ground_map: a darker image than it was judged on says nothing, and teaches nothing") {
  Bench alone, moving({"odometry"});
  FloorPair light(3.1), dark(2.2, 49), light_again(2.2);
  test::Box<Odometry> here;
  here->theta_rad = std::numbers::pi / 2;  // ahead is the map's y axis
  for (Bench* bench : {&alone, &moving}) {
    if (bench == &moving)
      for (int k = 0; k < 3; ++k) test::latch(bench->port("odometry"), here, (100 + 100 * k) * kMs, k + 1, k);
    test::latch(bench->port("pair"), light, 100 * kMs, 1);
    CHECK(bench->run());
    const int16_t wall = bench->cell(0.1, 3.1);
    CHECK(bench->cell(0.1, 2.5) < 500);
    test::latch(bench->port("pair"), dark, 200 * kMs, 2);
    CHECK(bench->run());
    CHECK(bench->mask_at(160, 230) == 0);
    // What the map has from lighter images stays; without a map there is nothing.
    CHECK(bench->cell(0.1, 3.1) == (bench == &moving ? wall : Grid::unknown));
    CHECK(bench->cell(0.1, 2.5) == (bench == &moving ? 400 : Grid::unknown));
    test::latch(bench->port("pair"), light_again, 300 * kMs, 3);
    CHECK(bench->run());
    CHECK(bench->cell(0.1, 2.3) >= 600);
  }
}

TEST_CASE("ground_map: motion is that of the camera, conjugated with its mount (E-25), and goes before odometry") {
  Bench bench({"motion", "odometry"});
  FloorPair pair(3.1);
  const UncertainPose mount{pair->sensor_in_robot, {}};
  // The robot turned by 90 degrees to the left about its own axis, 1 m to the right of where it started.
  const UncertainPose robot{{1, 0, 0, std::sqrt(0.5), 0, 0, std::sqrt(0.5)}, {}};
  test::Box<Motion> motion;
  motion->pose = compose(compose(inverse(mount), robot), mount).transform;
  test::Box<Odometry> odometry;
  odometry->x_m = 50;
  test::latch(bench.port("motion"), motion, 100 * kMs, 1);
  test::latch(bench.port("odometry"), odometry, 100 * kMs, 1);
  test::latch(bench.port("pair"), pair, 100 * kMs, 1);
  CHECK(bench.run());
  REQUIRE(bench.grid->sent());
  CHECK(bench.cell(1 - 2.5, 0.1) == 400);
  CHECK(bench.cell(1 - 3.15, 0.1) == 700);

  // The same pose of another camera, straight and level, 1.6 m above the robot's axis.
  Bench other({"motion"}, "other");
  const UncertainPose head{mapping_3d::camera_mount(0, 0, 1.6, 0, 0), {}};
  motion->pose = compose(compose(inverse(head), robot), head).transform;
  test::latch(other.port("motion"), motion, 100 * kMs, 1);
  test::latch(other.port("pair"), pair, 100 * kMs, 1);
  CHECK(other.run());
  REQUIRE(other.grid->sent());
  CHECK(other.cell(1 - 3.15, 0.1) == 700);
}

TEST_CASE("ground_map: an image whose pose is known goes before a newer one whose pose is not") {
  Bench bench({"odometry"});
  FloorPair old(3.1), newer(2.1);
  test::Box<Odometry> a;
  test::latch(bench.port("odometry"), a, 100 * kMs, 1);
  test::latch(bench.port("pair"), old, 100 * kMs, 1, 0);
  test::latch(bench.port("pair"), newer, 200 * kMs, 2, 1);
  CHECK(bench.run());
  CHECK(bench.mask->stamp_ns() == 100 * kMs);
  CHECK(bench.grid->sent());
}

TEST_CASE("ground_map allocates nothing in a job") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  Bench bench({"odometry", "scan"});
  FloorPair pair(3.1);
  test::Box<Odometry> a, b;
  b->x_m = 5;
  test::Box<LaserScan> scan({0, 0, 1, 181});
  test::latch(bench.port("odometry"), a, 100 * kMs, 1, 0);
  test::latch(bench.port("odometry"), b, 300 * kMs, 2, 1);
  test::latch(bench.port("scan"), scan, 150 * kMs, 1);
  test::latch(bench.port("pair"), pair, 150 * kMs, 1);
  const uint64_t before = thread_memory_use().allocations;
  CHECK(bench.run());
  CHECK(thread_memory_use().allocations == before);
  CHECK(bench.grid->sent());
}

TEST_CASE("ground_map refuses parameters that cannot work") {
  const auto refuses = [](std::string_view name, const ParamValue& value, const char* text) {
    NodeTypes types;
    register_ground_map(types);
    const auto node = types.find("ground_map")->make();
    test::set(*node, name, value);
    PortAccess::connect(test::input(*node, "pair"), kImage);
    CHECK_THROWS_WITH_AS(test::set_up(*node), doctest::Contains(text), SetupError);
  };
  refuses("mean_size", int64_t{4}, "mean_size is 4");
  refuses("trapezoid_height", 0.0, "the reference area is empty");
  refuses("t_w", 300.0, "nothing would ever be ground");
  refuses("terrain_maps", std::string("no_such_file.txt"), "no_such_file.txt: cannot be read");
}

TEST_CASE("ground_map: one that takes another's place knows the textures that were learnt, and its map") {
  FloorPair image(3.1);
  Bench first({"odometry"});
  test::BoxWriter<Image> textures(*first.node->outputs()[2]);
  test::Box<Odometry> before, now;
  const auto look = [&](Bench& bench, int64_t stamp_ns, uint64_t sequence) {
    test::latch(bench.port("odometry"), before, stamp_ns - 100 * kMs, 2 * sequence, 0);
    test::latch(bench.port("odometry"), now, stamp_ns, 2 * sequence + 1, 1);
    test::latch(bench.port("pair"), image, stamp_ns, sequence);
    return bench.run();
  };
  REQUIRE(look(first, 1000 * kMs, 1));
  REQUIRE(textures.message().height > 0);
  CHECK(first.cell(2.5, -0.1) != Grid::unknown);  // odometry at rest looks along x
  for (const bool handed_over : {true, false}) {
    CAPTURE(handed_over);
    Bench next({"odometry", "scan"});  // no scan says that the area before it is free: it learns nothing
    if (handed_over) {
      PortAccess::hand_over(*next.node->outputs()[2], &textures.message());
      PortAccess::hand_over(*next.node->outputs()[1], &first.grid->message());
    }
    next.node->start(0);
    for (OutputPort* output : next.node->outputs()) PortAccess::hand_over(*output, nullptr);
    REQUIRE(look(next, 2000 * kMs, 2));
    CHECK(next.mask_at(160, 230) == (handed_over ? 255 : 0));
    CHECK(next.mask_at(160, 10) == 0);
    CHECK((next.cell(2.5, -0.1) != Grid::unknown) == handed_over);
  }
}
