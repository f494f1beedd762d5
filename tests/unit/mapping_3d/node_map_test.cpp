// SPDX-License-Identifier: Apache-2.0
// The node on a walk through a generated room: fused clouds, the map, where poses come from, files.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <vector>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/mapping_3d/generated_world.hpp"
#include "nodes/mapping_3d/grid_file.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "rt/transform/pose_math.hpp"
#include "tests/temporary_folder.hpp"

namespace takt {
void register_mapping_3d(NodeTypes& types);
}

using namespace takt;
using namespace takt::mapping_3d;

namespace {

constexpr uint32_t kPoints = 160 * 120;

std::unique_ptr<Node> make_node() {
  NodeTypes types;
  register_mapping_3d(types);
  return types.find("mapping_3d")->make();
}

/// The node with its writers, fed with looks at a room.
class Walk {
 public:
  explicit Walk(const char* poses, std::unique_ptr<Node> made = make_node(), const std::filesystem::path& output = ".",
                bool with_grid = false)
      : poses_(poses), node_(std::move(made)), cloud_({0, 0, 1, kPoints}) {
    PortAccess::connect(test::input(*node_, "cloud"), {0, 0, 1, kPoints});
    PortAccess::connect(test::input(*node_, poses), {});
    PortAccess::connect(test::input(*node_, "correction"), {});
    if (with_grid) PortAccess::connect(test::input(*node_, "grid"), {10, 10, 1, 0});
    for (size_t i : {1, 2, 3}) PortAccess::mark_read(*node_->outputs()[i]);
    test::set_up(*node_, output);
    obstacles = std::make_unique<test::BoxWriter<Grid>>(*node_->outputs()[0]);
    fused = std::make_unique<test::BoxWriter<Grid>>(*node_->outputs()[1]);
    cloud = std::make_unique<test::BoxWriter<PointCloud>>(*node_->outputs()[2]);
    map = std::make_unique<test::BoxWriter<PointCloud>>(*node_->outputs()[3]);
    frame = std::make_unique<test::BoxWriter<Pose>>(*node_->outputs()[4]);
  }

  void look_from(double x, double y, double heading) {
    const Transform robot = robot_at(x, y, heading);
    const Look seen = look(world, {}, robot, lot);
    cloud_->camera = WorldCamera{}.model();
    cloud_->step_px = 4;
    cloud_->sensor_in_robot = compose(inverse({robot, {}}), {seen.camera_in_world, {}}).transform;
    cloud_->points.resize(0);
    cloud_->colours.resize(0);
    for (const Point& p : seen.points) cloud_->points.push_back(p);
    for (const Colour& c : seen.colours) cloud_->colours.push_back(c);
    run(x, y, heading);
  }

  void run(double x, double y, double heading) {
    stamp_ns += 500'000'000;
    ++sequence_;
    test::latch(test::input(*node_, "cloud"), cloud_, stamp_ns, sequence_);
    odometry_->x_m = x, odometry_->y_m = y, odometry_->theta_rad = heading + std::numbers::pi / 2;
    pose_->transform = robot_at(x, y, heading);
    if (std::string_view(poses_) == "odometry")
      test::latch(test::input(*node_, "odometry"), odometry_, stamp_ns, sequence_);
    else test::latch(test::input(*node_, "pose"), pose_, stamp_ns, sequence_);
    obstacles->clear(), fused->clear(), cloud->clear(), map->clear(), frame->clear();
    const uint64_t before = thread_memory_use().allocations;
    if (budget_ns == 0) {
      REQUIRE(test::run(*node_));
    } else {
      used_ns = 0;
      Job job(test::standing_clock, sequence_, 0, 1'000'000'000, 0, "full",
              {budget_ns, 0, [] { return used_ns += kTile_ns; }});
      node_->run(job);
    }
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  }

  double rms_of_map() {
    double squares = 0;
    for (const Point& p : map->message().points.items()) {
      const double off = distance_m(world, {p.x, p.y, p.z});
      squares += off * off;
    }
    return std::sqrt(squares / map->message().points.size);
  }

  Node& node() { return *node_; }
  test::Box<PointCloud>& cloud_box() { return cloud_; }

  World world = furnished_room(4);
  Lot lot{4, 0};
  int64_t stamp_ns = 0;
  static constexpr int64_t kTile_ns = 1'000'000;
  inline static int64_t used_ns = 0;  ///< of the budget, by the last job: each question finds a tile's worth more
  int64_t budget_ns = 0;              ///< 0: all the time in the world
  std::unique_ptr<test::BoxWriter<Grid>> obstacles, fused;
  std::unique_ptr<test::BoxWriter<PointCloud>> cloud, map;
  std::unique_ptr<test::BoxWriter<Pose>> frame;

 private:
  const char* poses_;
  std::unique_ptr<Node> node_;
  test::Box<PointCloud> cloud_;
  test::Box<Odometry> odometry_;
  test::Box<Pose> pose_;
  uint64_t sequence_ = 0;
};

}  // namespace

TEST_CASE("mapping_3d: fused clouds in the camera's frame, a map in the map's; nothing allocated in a job") {
  Walk walk("odometry");
  for (int i = 0; i < 8; ++i) walk.look_from(1.9, 0.15 * i - 0.5, 0.05 * i);
  REQUIRE(walk.cloud->sent());
  CHECK(walk.cloud->stamp_ns() == walk.stamp_ns - 2 * 500'000'000);  // the view in the middle of five
  CHECK(walk.cloud->message().points.size > 8000);
  CHECK(walk.cloud->message().colours.size == walk.cloud->message().points.size);
  CHECK(walk.cloud->message().camera.focal_px == 492.8);
  REQUIRE(walk.map->sent());
  CHECK(walk.map->stamp_ns() == walk.stamp_ns);
  CHECK(walk.map->message().points.size > 2000);
  CHECK(walk.rms_of_map() < 0.08);
}

TEST_CASE("mapping_3d: a pose from anywhere else in place of odometry gives the same grid and the same map") {
  Walk odometry("odometry"), pose("pose");
  for (int i = 0; i < 4; ++i) {
    odometry.look_from(1.9, 0.2 * i, 0.1 * i);
    pose.look_from(1.9, 0.2 * i, 0.1 * i);
    CHECK(std::equal(odometry.obstacles->message().cells.items().begin(),
                     odometry.obstacles->message().cells.items().end(),
                     pose.obstacles->message().cells.items().begin()));
  }
  CHECK(odometry.map->message().points.size == pose.map->message().points.size);
  CHECK(pose.obstacles->message().grid_in_map.y == doctest::Approx(0.6));
}

TEST_CASE(
    "mapping_3d: a job looks through the map tile by tile while its budget lasts; who has gone goes from the map") {
  constexpr int64_t kBudget_ns = 8 * Walk::kTile_ns, kReserve_ns = 5 * Walk::kTile_ns;
  auto node = make_node();
  test::set(*node, "tile", 0.5);
  Walk walk("odometry", std::move(node));
  walk.world = World{};
  walk.world.boxes.push_back({{-4, 4, 0}, {4, 4.1, 3}, {}});
  const World empty = walk.world;
  for (int i = 0; i < 6; ++i) walk.look_from(0.6 * i - 1.5, 0, 0);  // tiles beside each other
  const auto person = [&] {
    size_t count = 0;
    for (const Point& p : walk.map->message().points.items())
      count += std::abs(p.x) < 0.5 && std::abs(p.y - 2) < 0.5 && p.z > 0.3 && p.z < 1.7;
    return count;
  };
  add_person(walk.world, 0, 2);
  for (int i = 0; i < 6; ++i) walk.look_from(0, 0, 0);
  const size_t met = person();
  REQUIRE(met > 20);
  walk.world = empty;
  walk.budget_ns = kBudget_ns;
  int looks = 0;
  for (; looks < 100 && person() > met / 10; ++looks) {
    walk.look_from(0, 0, 0);
    CHECK(Walk::used_ns > kBudget_ns - kReserve_ns - Walk::kTile_ns);  // it used what there was
    CHECK(Walk::used_ns <= kBudget_ns - kReserve_ns);                  // and no more
  }
  CHECK(looks < 100);
  CHECK(looks > 12);  // of a map of several tiles no view was held against all
}

TEST_CASE("mapping_3d: after a correction grids of the poses' frame are laid where the map now is, and it says how") {
  Walk walk("pose", make_node(), ".", true);
  test::Box<Grid> other({10, 10, 1, 0});
  other->width = other->height = 10;
  other->cell_m = 0.2;
  other->grid_in_map = {1, 2, 0, 1, 0, 0, 0};  // a square of 2 m before the robot, in the frame of the poses
  REQUIRE(other->cells.resize(100));
  std::fill_n(other->cells.data(), 100, int16_t{1000});
  test::latch(test::input(walk.node(), "grid"), other, 0, 1);
  walk.world = World{};
  const auto at = [&](double x, double y) {  // a place seen from the robot
    Grid& grid = walk.fused->message();
    return grid.view().at(static_cast<int>((x - grid.origin_x_m) / grid.cell_m),
                          static_cast<int>((y - grid.origin_y_m) / grid.cell_m));
  };
  const auto check = [&] {
    walk.look_from(1, 1, 0);
    CHECK(at(0.1, 1.1) == 1000);
    CHECK(at(1.9, 2.9) == 1000);
    CHECK(at(-0.3, 1.1) != 1000);
    CHECK(at(0.1, 0.5) != 1000);
  };
  check();
  check();  // what is corrected came after the first image
  CHECK(walk.frame->message().transform.x == 0);
  test::Box<Pose> correction;
  correction->transform = robot_at(1.6, 1.2, 0.5);  // where the robot was in truth
  test::latch(test::input(walk.node(), "correction"), correction, walk.stamp_ns, 1);
  check();  // robot and grid have moved together: nothing changes between them
  REQUIRE(walk.frame->sent());
  CHECK(walk.fused->message().grid_in_map.x == doctest::Approx(1.6));
  const UncertainPose moved = compose({walk.frame->message().transform, {}}, {robot_at(1, 1, 0), {}});
  CHECK(moved.transform.x == doctest::Approx(1.6));
  CHECK(moved.transform.y == doctest::Approx(1.2));
}

TEST_CASE("mapping_3d: a correction moves what comes after it, and lays the map anew") {
  Walk walk("pose");
  for (int i = 0; i < 6; ++i) walk.look_from(1.9, 0.2 * i, 0);
  test::Box<Pose> correction;
  correction->transform = robot_at(1.9 + 0.5, 1.0, 0);
  test::latch(test::input(walk.node(), "correction"), correction, walk.stamp_ns, 1);
  walk.look_from(1.9, 1.0, 0);
  CHECK(walk.obstacles->message().grid_in_map.x == doctest::Approx(2.4));
  test::latch(test::input(walk.node(), "correction"), correction, walk.stamp_ns - 500'000'000, 1);
  PortAccess::set_held(test::input(walk.node(), "correction"), 1, false, 1);  // the same one, not new
  walk.look_from(1.9, 1.0, 0);
  CHECK(walk.obstacles->message().grid_in_map.x == doctest::Approx(2.4));
}

TEST_CASE("mapping_3d: clouds without a camera are a laser's, for obstacles and the map") {
  Walk walk("odometry");
  PointCloud& cloud = *walk.cloud_box();
  cloud.sensor_in_robot = {0, 0.3, 0.25, 1, 0, 0, 0};
  for (int sweep = 0; sweep < 8; ++sweep)
    for (int beam = -70; beam <= 70; ++beam) {
      const double angle = beam * 0.0087, range = 2.8 / std::cos(angle);
      cloud.points.push_back(
          {static_cast<float>(-range * std::sin(angle)), static_cast<float>(range * std::cos(angle)), 0});
    }
  walk.run(0, 0, 0);
  Grid& grid = walk.obstacles->message();
  const auto at = [&](double x, double y) {
    return grid.view().at(static_cast<int>((x - grid.origin_x_m) / grid.cell_m),
                          static_cast<int>((y - grid.origin_y_m) / grid.cell_m));
  };
  CHECK(at(0.1, 3.1) == 1000);
  CHECK(at(0.1, 2.1) == 0);
  CHECK(at(0.1, 4.1) == Grid::unknown);
  CHECK_FALSE(walk.cloud->sent());  // nothing to fuse
  REQUIRE(walk.map->sent());
  CHECK(walk.map->message().points.size > 30);
  CHECK(walk.map->message().points[0].z == doctest::Approx(0.25));
}

TEST_CASE("mapping_3d: maps are saved at the end and loaded at the start; other grids of the frame are laid over") {
  const test::TemporaryFolder folder;
  {
    auto node = make_node();
    test::set(*node, "save", std::string("saved"));
    Walk walk("odometry", std::move(node), folder.path);
    for (int i = 0; i < 6; ++i) walk.look_from(1.9, 0.2 * i - 0.5, 0);
    walk.node().finish();
  }
  const auto cloud = cloud::read_cloud(folder.path / "saved" / "map.ply");
  REQUIRE(cloud);
  CHECK(cloud->points.size() > 2000);
  const auto saved = read_grid(folder.path / "saved" / "map.yaml");
  REQUIRE(saved);
  size_t occupied = 0;
  for (const int16_t cell : saved->cells) occupied += cell == 1000;
  CHECK(occupied > 10);

  auto node = make_node();
  test::set(*node, "load", (folder.path / "saved" / "map.ply").string());
  test::set(*node, "load_grid", (folder.path / "saved" / "map.yaml").string());
  Walk walk("odometry", std::move(node), folder.path, true);
  test::Box<Grid> other({10, 10, 1, 0});
  other->width = other->height = 10;
  other->cell_m = 0.2;
  other->grid_in_map = {0, -2, 0, 1, 0, 0, 0};
  REQUIRE(other->cells.resize(100));
  std::fill_n(other->cells.data(), 100, int16_t{1000});
  test::latch(test::input(walk.node(), "grid"), other, 0, 1);
  walk.look_from(0, -2, std::numbers::pi);  // turned away from what is known
  CHECK(walk.map->message().points.size > 1500);
  const auto count = [](const Grid& grid) {
    return std::count(grid.cells.data(), grid.cells.data() + grid.cells.size, int16_t{1000});
  };
  CHECK(count(walk.fused->message()) > count(walk.obstacles->message()) + 90);

  for (const char* param : {"load", "load_grid"}) {
    auto without = make_node();
    test::set(*without, param, std::string("absent.ply"));
    CHECK_THROWS_WITH_AS(Walk("odometry", std::move(without)), doctest::Contains(param), SetupError);
  }
}
