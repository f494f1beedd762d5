// SPDX-License-Identifier: Apache-2.0
// The node on drives past obstacles: what it remembers, for how long, and from which poses.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <numbers>
#include <random>
#include <vector>

#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt {
void register_mapping_3d(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

int64_t cpu_ns() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return int64_t{t.tv_sec} * kSecond + t.tv_nsec;
}

/// Where the robot stands in the world; heading: its x axis, from the world's.
struct Place {
  double x = 0, y = 0, heading = 0;
  UncertainPose pose() const { return {{x, y, 0, std::cos(heading / 2), 0, 0, std::sin(heading / 2)}, {}}; }
};

struct Cells {
  std::vector<int16_t> all;
  int width = 0;
  double origin_m = 0, cell_m = 0;
  Transform grid_in_map;
  int at(double x, double y) const {
    return all[static_cast<size_t>(static_cast<int>((y - origin_m) / cell_m) * width +
                                   static_cast<int>((x - origin_m) / cell_m))];
  }
};

enum class Poses { motion, odometry, none };

/// mapping_3d with a camera 0.2 m before the robot's centre, driven through a world of posts.
class Mapper {
 public:
  Mapper(Poses poses, int64_t window, size_t capacity = 30000)
      : poses_(poses), cloud_({0, 0, 1, static_cast<uint32_t>(capacity)}) {
    NodeTypes types;
    register_mapping_3d(types);
    CHECK(types.find("mapping_3d")->layer == Layer::perception);  // odometry comes from a sensor
    node_ = types.find("mapping_3d")->make();
    test::set(*node_, "window", window);
    PortAccess::connect(port("cloud"), {0, 0, 1, static_cast<uint32_t>(capacity)});
    if (poses == Poses::motion) PortAccess::connect(port("motion"), {});
    if (poses == Poses::odometry) PortAccess::connect(port("odometry"), {});
    test::set_up(*node_);
    out_ = std::make_unique<test::BoxWriter<Grid>>(*node_->outputs()[0]);
    cloud_->camera = {123.2, 79.5, 59.5, 0.24};
    cloud_->sensor_in_robot = mount_.transform;
  }

  /// One cloud of the posts in view (a metre to 5.5 m ahead, within 30 degrees), seen from there.
  Cells look(const Place& robot, const std::vector<std::array<double, 2>>& posts) {
    cloud_->points.resize(0);
    const mapping_3d::Affine to_camera = mapping_3d::to_affine(inverse(compose(robot.pose(), mount_)).transform);
    for (const auto& post : posts)
      for (int i = 0; i < 400; ++i) {
        const double w[3] = {post[0] + 0.004 * (i % 20 - 10), post[1] + 0.004 * (i / 20 - 10), 0.7 + 0.0004 * i};
        double c[3];
        for (int a = 0; a < 3; ++a)
          c[a] = to_camera.r[3 * a] * w[0] + to_camera.r[3 * a + 1] * w[1] + to_camera.r[3 * a + 2] * w[2] +
                 to_camera.t[a];
        if (c[2] > 1 && c[2] < 5.5 && std::abs(c[0]) < 0.577 * c[2])
          cloud_->points.push_back({static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])});
      }
    return run(robot);
  }

  Cells run(const Place& robot) {
    if (!started_) start_ = robot.pose();
    motion_->keyframe = !started_ || restart;
    if (restart) start_ = robot.pose();
    started_ = true;
    restart = false;
    stamp_ns_ += kSecond / 2;
    ++sequence_;
    test::latch(port("cloud"), cloud_, stamp_ns_, sequence_);
    motion_->pose = compose(compose(inverse(mount_), compose(inverse(start_), robot.pose())), mount_).transform;
    if (poses_ == Poses::motion) test::latch(port("motion"), motion_, stamp_ns_, sequence_);
    odometry_->x_m = robot.x;
    odometry_->y_m = robot.y;
    odometry_->theta_rad = robot.heading + std::numbers::pi / 2;
    if (poses_ == Poses::odometry) test::latch(port("odometry"), odometry_, stamp_ns_, sequence_);
    out_->clear();
    const uint64_t before = thread_memory_use().allocations;
    const int64_t cpu = cpu_ns();
    REQUIRE(test::run(*node_));
    last_ms = static_cast<double>(cpu_ns() - cpu) * 1e-6;
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    REQUIRE(out_->sent());
    Grid& g = out_->message();
    return {{g.cells.items().begin(), g.cells.items().end()}, g.width, g.origin_x_m, g.cell_m, g.grid_in_map};
  }

  PointCloud& cloud() { return *cloud_; }
  const Transform& mount() const { return mount_.transform; }
  bool restart = false;  ///< ego-motion begins anew with the next cloud
  double last_ms = 0;    ///< CPU time of the last job

 private:
  InputPort& port(std::string_view name) { return test::input(*node_, name); }

  Poses poses_;
  UncertainPose mount_{mapping_3d::camera_mount(0.05, 0.2, 1.5, 0.02, -0.2), {}};
  std::unique_ptr<Node> node_;
  std::unique_ptr<test::BoxWriter<Grid>> out_;
  test::Box<PointCloud> cloud_;
  test::Box<Motion> motion_;
  test::Box<Odometry> odometry_;
  UncertainPose start_;
  bool started_ = false;
  int64_t stamp_ns_ = 0;
  uint64_t sequence_ = 0;
};

using mapping_3d::kFree, mapping_3d::kOccupied, mapping_3d::kUnknown;
const std::vector<std::array<double, 2>> kPost{{0.5, 4.1}};

}  // namespace

TEST_CASE("a robot that passes an obstacle remembers it after it has left the view, where it is") {
  for (const Poses poses : {Poses::motion, Poses::odometry}) {
    Mapper mapper(poses, 5), alone(poses, 1);
    for (const double y : {0.0, 1.2, 2.4, 3.6}) {
      const Cells merged = mapper.look({0, y, 0}, kPost), single = alone.look({0, y, 0}, kPost);
      CHECK(merged.at(0.5, 4.1 - y) == kOccupied);
      CHECK(single.at(0.5, 4.1 - y) == (y < 2.8 ? kOccupied : kUnknown));
    }
    const Cells passed = mapper.look({0, 4.8, 0}, kPost);
    CHECK(passed.at(0.5, -0.7) == kOccupied);  // beside and behind
    CHECK(passed.at(0.1, -0.7) == kFree);      // where it drove
    CHECK(alone.look({0, 4.8, 0}, kPost).at(0.1, -0.7) == kUnknown);
  }
}

TEST_CASE("a moving window forgets what its clouds no longer show") {
  for (const int64_t window : {1, 2, 5, 16}) {
    CAPTURE(window);
    Mapper mapper(Poses::motion, window);
    mapper.look({}, kPost);
    for (int64_t newer = 1; newer < window; ++newer) {
      const Cells cells = mapper.look({}, {});
      CHECK(cells.at(0.5, 4.1) == kOccupied);
    }
    CHECK(mapper.look({}, {}).at(0.5, 4.1) == kFree);
  }
}

TEST_CASE("a remembered wall has no hole, whichever way the robot turns") {
  std::vector<std::array<double, 2>> wall;
  for (int i = 0; i <= 40; ++i) wall.push_back({-1.0 + 0.05 * i, 3.0 + 0.01 * i});
  for (int k = 0; k < 60; ++k) {
    CAPTURE(k);
    Mapper mapper(Poses::odometry, 2);
    mapper.look({}, wall);
    const Cells cells = mapper.look({0.013 * k, 0, -3.0 + 0.1 * k}, {});
    // Occupied cells reached from one of them by steps to the eight neighbours.
    std::vector<size_t> open;
    std::vector<bool> reached(cells.all.size());
    const size_t occupied = static_cast<size_t>(std::count(cells.all.begin(), cells.all.end(), mapping_3d::kOccupied));
    open.push_back(
        static_cast<size_t>(std::find(cells.all.begin(), cells.all.end(), mapping_3d::kOccupied) - cells.all.begin()));
    REQUIRE(occupied >= 9);  // 2 m of 0.2 m cells
    CHECK(occupied <= 32);
    reached[open[0]] = true;
    size_t found = 0;
    const auto width = static_cast<ptrdiff_t>(cells.width);
    for (; found < open.size(); ++found)
      for (const ptrdiff_t step :
           {-width - 1, -width, -width + 1, ptrdiff_t{-1}, ptrdiff_t{1}, width - 1, width, width + 1}) {
        const auto next = static_cast<size_t>(static_cast<ptrdiff_t>(open[found]) + step);
        if (next >= cells.all.size() || reached[next] || cells.all[next] != mapping_3d::kOccupied) continue;
        reached[next] = true;
        open.push_back(next);
      }
    CHECK(found == occupied);
  }
}

TEST_CASE("odometry and motion give the same grid on the same drive, with turns and from any start") {
  std::mt19937 random(4);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  std::vector<std::array<double, 2>> posts;
  for (int i = 0; i < 80; ++i) posts.push_back({uniform(-8, 12), uniform(-12, 8)});
  Mapper by_motion(Poses::motion, 5), by_odometry(Poses::odometry, 5);
  Place robot{3, -2, 0.7};
  size_t occupied = 0;
  for (int step = 0; step < 25; ++step) {
    const Cells a = by_motion.look(robot, posts), b = by_odometry.look(robot, posts);
    CHECK(a.all == b.all);
    occupied += static_cast<size_t>(std::count(a.all.begin(), a.all.end(), mapping_3d::kOccupied));
    // Both say where the robot is: from its start, and in the odometry frame.
    const UncertainPose start = Place{3, -2, 0.7}.pose();
    CHECK(compose(start, {a.grid_in_map, {}}).transform.x == doctest::Approx(b.grid_in_map.x));
    CHECK(b.grid_in_map.x == doctest::Approx(robot.x));
    CHECK(b.grid_in_map.y == doctest::Approx(robot.y));
    // Forward is the robot's y: theta - 90 degrees (C-9).
    const double step_m = uniform(0, 0.7), theta = robot.heading + std::numbers::pi / 2;
    robot.x += step_m * std::cos(theta);
    robot.y += step_m * std::sin(theta);
    robot.heading += uniform(-0.5, 0.5);
  }
  CHECK(occupied > 100);
}

TEST_CASE("the robot frame in the odometry frame: forward is theta, right is theta - 90 degrees") {
  Odometry odometry;
  odometry.x_m = 2, odometry.y_m = 3, odometry.theta_rad = 0.3;
  const mapping_3d::Affine a = mapping_3d::to_affine(mapping_3d::robot_in_odometry(odometry));
  CHECK(a.r[1] == doctest::Approx(std::cos(0.3)));
  CHECK(a.r[4] == doctest::Approx(std::sin(0.3)));
  CHECK(a.r[0] == doctest::Approx(std::sin(0.3)));
  CHECK(a.r[3] == doctest::Approx(-std::cos(0.3)));
  CHECK(a.r[8] == doctest::Approx(1));
  CHECK(a.t[0] == 2);
  CHECK(a.t[1] == 3);
}

TEST_CASE("a window of 1, and any window without poses, gives the grid of the newest cloud alone") {
  for (const auto& [poses, window] :
       {std::pair{Poses::motion, 1}, {Poses::odometry, 1}, {Poses::none, 1}, {Poses::none, 5}}) {
    Mapper mapper(poses, window);
    mapping_3d::ObstacleGrid grid{mapping_3d::ObstacleParameters{}};
    for (const double y : {0.0, 1.0, 2.0}) {
      const Cells cells = mapper.look({0, y, 0.1 * y}, {{0.5, 4.1}, {-0.4, 4.5}});
      std::vector<int16_t> expected(cells.all.size());
      grid.fill(mapper.cloud().points.items(), {mapper.mount(), 123.2, std::atan2(79.5, 123.2)},
                {expected.data(), cells.width, cells.width});
      CHECK(std::count(expected.begin(), expected.end(), mapping_3d::kOccupied) > 0);
      CHECK(cells.all == expected);
    }
  }
}

TEST_CASE("where ego-motion begins anew, views of the frame before are dropped") {
  Mapper mapper(Poses::motion, 5);
  mapper.look({}, kPost);
  CHECK(mapper.look({}, {}).at(0.5, 4.1) == kOccupied);
  mapper.restart = true;
  CHECK(mapper.look({}, {}).at(0.5, 4.1) == kFree);
}

TEST_CASE("cost of a job" * doctest::skip()) {  // a figure and no check; run with --no-skip
  for (const auto& [points, window] : {std::pair{19200, 1}, {19200, 5}, {19200, 16}, {307200, 1}, {307200, 5}}) {
    Mapper mapper(Poses::odometry, window, 307200);
    // A floor with a box on every second metre, as a camera 1.5 m high sees them.
    std::mt19937 random(1);
    const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
    for (int i = 0; i < points; ++i) {
      const double depth = uniform(1, 6), across = uniform(-0.6, 0.6) * depth;
      const bool box = std::fmod(across + 20, 2) < 1 && depth > 3;
      mapper.cloud().points.push_back(
          {static_cast<float>(across), static_cast<float>(box ? uniform(0.5, 1.4) : 1.5), static_cast<float>(depth)});
    }
    mapper.cloud().camera.focal_px = 492.8 * std::sqrt(points / 307200.0);
    std::vector<double> ms;
    for (int i = 0; i < 60; ++i) {
      mapper.run({0.3 * i, 0, 0.05 * i});
      ms.push_back(mapper.last_ms);
    }
    std::sort(ms.begin(), ms.end());
    MESSAGE(points << " points, window " << window << ": " << ms[30] << " ms median, " << ms.back() << " ms maximum");
  }
}
