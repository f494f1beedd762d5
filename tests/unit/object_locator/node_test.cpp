// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/semantic/reports.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/temporary_folder.hpp"

namespace takt {
void register_object_locator(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr CameraModel kCamera{120, 79.5, 59.5, 0.25};
using test::kMs;
const Transform kMount = mapping_3d::camera_mount(-0.1, 0.2, 1.4, 0, 0);

constexpr const char* kDatabase = "object ball\nview a.png\nobject bottle closed=true level=full\nview b.png\n";

/// A wall of one distance before the camera.
struct Wall : test::Box<DisparityMap> {
  explicit Wall(double z_m) : Box({kWidth, kHeight, 1, 0}) {
    DisparityMap& map = **this;
    map.width = kWidth, map.height = kHeight, map.camera = kCamera;
    map.disparity.resize(kWidth * kHeight);
    for (int16_t& d : map.disparity.items())
      d = static_cast<int16_t>(std::lround(kCamera.focal_px * kCamera.baseline_m / z_m));
  }
};

struct Fixture {
  VirtualClock clock;
  test::TemporaryFolder folder;
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<ObjectReports>> reports;
  test::Box<Detections> detections{{0, 0, 1, 4}};
  test::Box<StereoPair> pair{{0, 0, 1, 0}};
  Wall wall{3};
  uint64_t jobs = 0;

  explicit Fixture(const std::string& database = kDatabase, bool with_head = false) {
    NodeTypes types;
    register_object_locator(types);
    REQUIRE(types.find("object_locator")->layer == Layer::processing);
    node = types.find("object_locator")->make();
    folder.write("objects.txt", database);
    test::set(*node, "database", std::string("."));
    PortAccess::connect(port("detections"), {0, 0, 1, 4});
    PortAccess::connect(port("disparity"), {kWidth, kHeight, 1, 0});
    PortAccess::connect(port("pair"), {});
    if (with_head) PortAccess::connect(port("head"), {});
    pair->sensor_in_robot = kMount;
  }
  InputPort& port(const char* name) { return test::input(*node, name); }
  void set_up() {
    Setup setup{clock, folder.path, folder.path, 0, std::nullopt, 0};
    node->setup(setup);
    reports = std::make_unique<test::BoxWriter<ObjectReports>>(*node->outputs()[0]);
  }
  /// A box whose middle is there, of 20 x 20 pixels.
  void box(float class_id, float x_px, float y_px) {
    detections->boxes.push_back({class_id, x_px - 10, y_px - 10, 20, 20, 0.8F});
  }
  /// False: no result. The boxes are forgotten by this function.
  bool job(int64_t stamp_ns) {
    test::latch(port("detections"), detections, stamp_ns, ++jobs);
    test::latch(port("pair"), pair, 0, 1);
    reports->clear();
    Job job(clock, jobs, stamp_ns, stamp_ns + 66 * kMs, 0, "full");
    const uint64_t before = thread_memory_use().allocations;
    node->run(job);
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    detections->boxes.resize(0);
    CHECK(reports->sent() != job.without_result());
    if (reports->sent()) CHECK(reports->stamp_ns() == stamp_ns);
    return reports->sent();
  }
  const ObjectReports& seen() { return reports->message(); }
};

}  // namespace

TEST_CASE("object_locator: type, attributes, score and place of each detection, in the robot frame") {
  Fixture f;
  f.set_up();
  test::latch(f.port("disparity"), f.wall, 0, 1);
  f.box(1, 119.5, 59.5);  // 3 m ahead, a third of that to the right
  f.box(0, 79.5, 99.5);   // and below
  f.box(7, 79.5, 59.5);   // no such entry
  REQUIRE(f.job(0));
  CHECK(f.seen().in_map == 0);
  REQUIRE(f.seen().names.size == 2);
  REQUIRE(f.seen().places.size == 2);
  CHECK(f.seen().names[0].type == std::string_view("bottle"));
  CHECK(f.seen().names[0].name[0] == '\0');
  CHECK(f.seen().names[1].type == std::string_view("ball"));
  const ObjectPlace &bottle = f.seen().places[0], &ball = f.seen().places[1];
  CHECK(bottle.x_m == doctest::Approx(-0.1 + 1));
  CHECK(bottle.y_m == doctest::Approx(0.2 + 3));
  CHECK(bottle.z_m == doctest::Approx(1.4));
  CHECK(bottle.score == 0.8F);
  CHECK(bottle.attributes == 2);
  CHECK(ball.x_m == doctest::Approx(-0.1));
  CHECK(ball.z_m == doctest::Approx(0.4));
  CHECK(ball.attributes == 0);
  REQUIRE(f.seen().attributes.size == 2);
  CHECK(f.seen().attributes[0].name == std::string_view("closed"));
  CHECK(f.seen().attributes[0].value == std::string_view("true"));
  CHECK(f.seen().attributes[1].value == std::string_view("full"));
}

TEST_CASE("object_locator: of boxes of one type at one place the best is reported, if asked for") {
  for (const double apart_m : {0.0, 0.3}) {
    Fixture f("object cup level=empty\nview a.png\nobject cup level=full\nview b.png\nobject jug\nview c.png\n");
    test::set(*f.node, "apart", apart_m);
    f.set_up();
    test::latch(f.port("disparity"), f.wall, 0, 1);
    f.box(1, 79.5, 59.5);  // a pixel is 2.5 cm there
    f.box(0, 85.5, 59.5);  // the same one in a worse box
    f.box(2, 79.5, 59.5);  // another type
    f.box(0, 99.5, 59.5);  // another one, 0.5 m beside
    REQUIRE(f.job(0));
    REQUIRE(f.seen().names.size == (apart_m > 0 ? 3 : 4));
    CHECK(f.seen().attributes[0].value == std::string_view("full"));
    CHECK(f.seen().names[apart_m > 0 ? 1 : 2].type == std::string_view("jug"));
  }
}

TEST_CASE("object_locator: the disparities nearest in time count, and none that are 0.25 s away") {
  Fixture f;
  f.set_up();
  Wall near(2);
  const auto distance_at = [&](int64_t stamp_ns) -> double {
    test::latch(f.port("disparity"), f.wall, 1000 * kMs, 1, 0);
    test::latch(f.port("disparity"), near, 1200 * kMs, 2, 1);
    f.box(0, 79.5, 59.5);
    return f.job(stamp_ns) ? f.seen().places[0].y_m - 0.2 : 0;
  };
  CHECK(distance_at(1090 * kMs) == doctest::Approx(3));
  CHECK(distance_at(1110 * kMs) == doctest::Approx(2));
  CHECK(distance_at(750 * kMs) == doctest::Approx(3));
  CHECK(distance_at(749 * kMs) == 0);
  CHECK(distance_at(1450 * kMs) == doctest::Approx(2));
  CHECK(distance_at(1451 * kMs) == 0);
}

TEST_CASE("object_locator: no place, no report; what is too far is none; a middle lies behind its front") {
  Fixture f;
  test::set(*f.node, "range_max", 2.5);
  test::set(*f.node, "half_depth", 0.5);
  f.set_up();
  test::latch(f.port("disparity"), f.wall, 0, 1);
  f.box(0, 79.5, 59.5);
  REQUIRE(f.job(0));
  CHECK(f.seen().names.empty());
  Wall near(2);
  test::latch(f.port("disparity"), near, 0, 2);
  f.box(0, 79.5, 59.5);
  f.box(0, 139.5, 59.5);
  REQUIRE(f.job(1));
  REQUIRE(f.seen().names.size == 2);
  CHECK(f.seen().places[0].y_m == doctest::Approx(0.2 + 2.5));
  CHECK(std::hypot(f.seen().places[1].x_m + 0.1, f.seen().places[1].y_m - 0.2) ==
        doctest::Approx(std::hypot(1, 2) + 0.5));
  for (int16_t& d : near->disparity.items()) d = DisparityMap::invalid;
  f.box(0, 79.5, 59.5);
  REQUIRE(f.job(2));
  CHECK(f.seen().names.empty());
  near->width = 100;  // not as large as it says
  CHECK_FALSE(f.job(3));
  f.pair->sensor_in_robot = {};
  test::latch(f.port("disparity"), f.wall, 0, 3);
  CHECK_FALSE(f.job(4));  // nobody knows where the camera is
}

TEST_CASE("object_locator: the camera looks where the head turned it at the stamp") {
  Fixture f(kDatabase, true);
  f.set_up();
  test::latch(f.port("disparity"), f.wall, 0, 1);
  f.box(0, 79.5, 59.5);
  CHECK_FALSE(f.job(0));  // the head has not said anything
  test::Box<HeadState> left;
  left->pan_rad = std::acos(0.0);
  test::latch(f.port("head"), left, 0, 1);
  f.box(0, 79.5, 59.5);
  REQUIRE(f.job(1));
  CHECK(f.seen().places[0].x_m == doctest::Approx(-0.1 - 3));
  CHECK(f.seen().places[0].y_m == doctest::Approx(0.2));
}

TEST_CASE("object_locator refuses a database that is none, or that it could not report") {
  Fixture none("view a.png\n");
  CHECK_THROWS_WITH_AS(none.set_up(), doctest::Contains("objects.txt:1: `view` stands before the first"), SetupError);
  Fixture longer("object " + std::string(32, 'x') + "\nview a.png\n");
  CHECK_THROWS_WITH_AS(longer.set_up(), doctest::Contains("cannot be reported"), SetupError);
}
