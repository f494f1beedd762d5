// SPDX-License-Identifier: Apache-2.0
// All devices of the robot on one world in one process: two stereo cameras of different rates, head, lines, laser,
// base.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cmath>
#include <filesystem>
#include <set>
#include <thread>

#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/graph_folder.hpp"
#include "tests/own_threads.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;

namespace {

constexpr int64_t kAceEpoch = 3'000'000'000;
const std::filesystem::path kGraph = takt::test::graph_folder();

StereoRig rig(const char* name) {
  auto loaded = load_rig("camera", kGraph / "rigs" / name);
  REQUIRE_MESSAGE(loaded.has_value(), (loaded ? "" : loaded.error().text()));
  return *loaded;
}

struct Pair {
  StereoFrame frame;
  test::GuardedImage left, right;
  bool operator==(const Pair& other) const {
    return frame.stamp_ns == other.frame.stamp_ns && left.bytes == other.left.bytes && right.bytes == other.right.bytes;
  }
};

/// The clock of a run, turned on by the test from release to release: loading the world takes none of the run's time,
/// on however slow a machine.
class ClockOfRun final : public Clock {
 public:
  int64_t now_ns() const override { return now_ns_.load(); }
  bool is_virtual() const override { return false; }
  void set(int64_t now_ns) { now_ns_.store(now_ns); }

 private:
  std::atomic<int64_t> now_ns_ = kAceEpoch - 1'000'000'000;
};

/// The devices of ACE, opened and started.
struct Ace {
  std::unique_ptr<Simulation> world;
  std::unique_ptr<SimCamera> head_camera, ground_camera;
  std::unique_ptr<SimHead> head;
  std::unique_ptr<SimLines> lines;
  std::unique_ptr<SimLaser> laser;
  std::unique_ptr<SimBase> base;
  std::vector<float> range;

  explicit Ace(const Clock& clock, bool background = false) {
    auto loaded = Simulation::load("camera", kGraph / "worlds/lab.xml", "", 5);
    REQUIRE_MESSAGE(loaded.has_value(), (loaded ? "" : loaded.error().text()));
    world = std::move(*loaded);
    head_camera = std::make_unique<SimCamera>(
        "head_camera", SimCameraSettings{rig("xb3.yaml"), {}, {15, 1}, background}, *world, clock);
    ground_camera = std::make_unique<SimCamera>(
        "ground_camera", SimCameraSettings{rig("x2_wide.yaml"), {}, {5, 1}, background}, *world, clock);
    head = std::make_unique<SimHead>("head", *world);
    lines = std::make_unique<SimLines>("lines", *world);
    laser = std::make_unique<SimLaser>("front_laser", LaserModel{}, *world);
    base = std::make_unique<SimBase>("base", OdometryModel{}, *world);
    for (Device* device : std::initializer_list<Device*>{head_camera.get(), ground_camera.get(), head.get(),
                                                         lines.get(), laser.get(), base.get()}) {
      REQUIRE(device->open().has_value());
      REQUIRE(device->start(kAceEpoch).has_value());
    }
    range.resize(laser->format().beams);
  }

  /// One release of everything but the cameras.
  void read_others(int64_t at_ns) {
    CHECK(head->read(at_ns, INT64_MAX).status == ReadStatus::ok);
    CHECK(lines->read(at_ns).status == ReadStatus::ok);
    CHECK(laser->read(range, at_ns, INT64_MAX).status == ReadStatus::ok);
    CHECK(base->read(at_ns, INT64_MAX).status == ReadStatus::ok);
  }
};

Pair read(SimCamera& camera) {
  const StereoFormat format = camera.format();
  Pair pair{{}, test::GuardedImage(format), test::GuardedImage(format)};
  pair.frame = camera.read(pair.left.view(), pair.right.view(), INT64_MAX);
  CHECK(pair.frame.status == ReadStatus::ok);
  return pair;
}
Pair expose(SimCamera& camera, int64_t at_ns) {
  camera.trigger(at_ns);
  return read(camera);
}

int64_t release(int64_t hz, int64_t k) { return Rate{hz, 1}.release_ns(kAceEpoch, k); }

/// What one camera shows at the pixels where the other one sees the same points, by ground truth.
struct CommonView {
  int in_view = 0, same_depth = 0;
  std::vector<int> difference;  ///< of the green levels, at points of the same depth
};
CommonView common_view(const Simulation& world, int64_t at_ns, Pair& wide, Pair& narrow) {
  const StereoRig from = rig("x2_wide.yaml"), to = rig("xb3.yaml");
  std::vector<float> depth(static_cast<size_t>(from.width * from.height)),
      other(static_cast<size_t>(to.width * to.height));
  world.true_depth(from, at_ns, depth.data());
  world.true_depth(to, at_ns, other.data());
  const CameraPose a = world.camera_pose(from, 0, at_ns), b = world.camera_pose(to, 0, at_ns);
  CommonView view;
  for (int y = 0; y < from.height; y += 3) {
    for (int x = 0; x < from.width; x += 3) {
      const auto z = static_cast<double>(depth[static_cast<size_t>(y * from.width + x)]);
      const Vec3 ray((x - from.cu_px) / from.focal_px, (y - from.cv_px) / from.focal_px, 1);
      const Vec3 seen = b.rotation.transpose() * (a.rotation * (z * ray) + a.position - b.position);
      if (seen.z() < 0.1) continue;
      const auto u = static_cast<int>(std::lround(to.cu_px + to.focal_px * seen.x() / seen.z())),
                 v = static_cast<int>(std::lround(to.cv_px + to.focal_px * seen.y() / seen.z()));
      if (u < 0 || v < 0 || u >= to.width || v >= to.height) continue;
      ++view.in_view;
      const auto found = static_cast<double>(other[static_cast<size_t>(v * to.width + u)]);
      if (std::abs(found - seen.z()) > 0.02 * seen.z()) continue;  // hidden from the other camera, or at an edge
      ++view.same_depth;
      view.difference.push_back(std::abs(wide.left.view().at(x, y, 1) - narrow.left.view().at(u, v, 1)));
    }
  }
  return view;
}
int median(std::vector<int> values) {
  REQUIRE_FALSE(values.empty());
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

TEST_CASE("all devices run together at their rates, and share the instants of their common releases") {
  VirtualClock clock(kAceEpoch);
  Ace ace(clock);
  std::set<int64_t> head_stamps, ground_stamps;
  for (int64_t k = 0; k < 15; ++k) {
    clock.advance_to(release(15, k));
    ace.read_others(release(15, k));
    const Pair head = expose(*ace.head_camera, release(15, k));
    CHECK(head.frame.frame_number == k);
    head_stamps.insert(head.frame.stamp_ns);
    if (k % 3 != 0) continue;
    const Pair ground = expose(*ace.ground_camera, release(5, k / 3));
    CHECK(ground.frame.frame_number == k / 3);
    ground_stamps.insert(ground.frame.stamp_ns);
  }
  CHECK(head_stamps.size() == 15);
  CHECK(ground_stamps.size() == 5);
  CHECK(std::includes(head_stamps.begin(), head_stamps.end(), ground_stamps.begin(), ground_stamps.end()));
}

TEST_CASE("at one instant both cameras see the same world: the same points at the same depth, looking alike") {
  VirtualClock clock(kAceEpoch);
  Ace ace(clock);
  for (int64_t k = 0; k <= 60; ++k) {
    const int64_t at = release(15, k);
    ace.head->command(k < 30 ? -0.2 : 0.25, -0.2, at);
    ace.read_others(at);
    if (k % 20 != 0 || k == 0) continue;  // the robot drives, and has turned its head
    Pair narrow = expose(*ace.head_camera, at), wide = expose(*ace.ground_camera, at);
    CHECK(narrow.frame.stamp_ns == wide.frame.stamp_ns);
    const CommonView now = common_view(*ace.world, at, wide, narrow);
    CHECK(now.in_view > 4000);
    CHECK(now.same_depth > 0.9 * now.in_view);
    // Another instant of the same drive does not fit.
    Pair later = expose(*ace.ground_camera, at + 400'000'000);
    const CommonView then = common_view(*ace.world, at, later, narrow);
    CHECK(median(now.difference) < 10);
    CHECK(median(now.difference) < 0.7 * median(then.difference));
  }
}

TEST_CASE("pan and tilt of the head move the head camera only") {
  VirtualClock clock(kAceEpoch);
  Ace still(clock), turning(clock);
  const StereoRig narrow = rig("xb3.yaml"), wide = rig("x2_wide.yaml");
  for (int64_t k = 0; k <= 18; ++k) {
    const int64_t at = release(15, k);
    turning.head->command(0.4, -0.3, at);
    still.read_others(at);
    turning.read_others(at);
    const HeadReading head = turning.world->head(at);
    const CameraPose moved = turning.world->camera_pose(narrow, 0, at), rest = still.world->camera_pose(narrow, 0, at);
    // The angle between both views is that of the head's two turns: pan about the vertical, then tilt.
    const double cosine = ((rest.rotation.transpose() * moved.rotation).trace() - 1) / 2,
                 expected = Eigen::AngleAxisd((Eigen::AngleAxisd(-head.pan_rad, Vec3::UnitY()) *
                                               Eigen::AngleAxisd(head.tilt_rad, Vec3::UnitX()))
                                                  .toRotationMatrix())
                                .angle();
    CHECK(std::acos(std::clamp(cosine, -1.0, 1.0)) == doctest::Approx(expected).epsilon(0.15));
    CHECK(turning.world->camera_pose(wide, 1, at).rotation == still.world->camera_pose(wide, 1, at).rotation);
    CHECK(turning.world->camera_pose(wide, 1, at).position == still.world->camera_pose(wide, 1, at).position);
    if (k % 6 != 0) continue;
    const bool moves = head.pan_rad != 0;
    CHECK(moves == (k > 0));
    CHECK((expose(*turning.head_camera, at) == expose(*still.head_camera, at)) == !moves);
    CHECK(expose(*turning.ground_camera, at) == expose(*still.ground_camera, at));
  }
  CHECK(turning.world->head(release(15, 18)).pan_rad > 0.2);
}

TEST_CASE("the cost of each camera's rendering is told apart, and that of no other device is in it") {
  VirtualClock clock(kAceEpoch);
  Ace ace(clock);
  const SimulatorCost before = simulator_cost();
  ace.read_others(kAceEpoch);
  CHECK(simulator_cost().total_ns() == before.total_ns());
  for (int64_t k = 0; k < 3; ++k) expose(*ace.head_camera, release(15, k));
  CHECK(ace.head_camera->cost().in_read_ns > 0);
  CHECK(ace.ground_camera->cost().total_ns() == 0);
  expose(*ace.ground_camera, kAceEpoch);
  const SimulatorCost head = ace.head_camera->cost(), ground = ace.ground_camera->cost();
  CHECK(ground.in_read_ns > 0);
  CHECK(head.ahead_ns + ground.ahead_ns == 0);
  CHECK(simulator_cost().total_ns() - before.total_ns() == head.total_ns() + ground.total_ns());
}

TEST_CASE("both cameras render ahead in threads of their own, while all else moves, and give the same bytes") {
  constexpr int64_t kReleases = 13;  // of 15 Hz: five of 5 Hz
  std::vector<Pair> expected_head, expected_ground;
  {
    VirtualClock clock(kAceEpoch);
    Ace ace(clock);
    for (int64_t k = 0; k < kReleases; ++k) {
      ace.head->command(0.5, 0, release(15, k));
      ace.read_others(release(15, k));
      expected_head.push_back(expose(*ace.head_camera, release(15, k)));
      if (k % 3 == 0) expected_ground.push_back(expose(*ace.ground_camera, release(5, k / 3)));
    }
  }
  ClockOfRun clock;
  Ace ace(clock, true);
  std::vector<Pair> head, ground;
  std::barrier release_begins(3), release_ends(3);
  // As the camera node does it: read the exposure asked for before, then ask for the next.
  const auto job = [&](SimCamera& camera, int64_t hz, std::vector<Pair>& pairs) {
    camera.trigger(kAceEpoch);
    for (int64_t k = 0; k < kReleases; ++k) {
      release_begins.arrive_and_wait();
      if (const int64_t every = 15 / hz; k % every == 0) {
        while (!camera.idle()) std::this_thread::yield();
        pairs.push_back(read(camera));
        camera.trigger(release(hz, k / every + 1));
      }
      release_ends.arrive_and_wait();
    }
  };
  std::thread head_job([&] { job(*ace.head_camera, 15, head); });
  std::thread ground_job([&] { job(*ace.ground_camera, 5, ground); });
  for (int64_t k = 0; k < kReleases; ++k) {
    clock.set(release(15, k));
    ace.head->command(0.5, 0, release(15, k));  // the threads still render
    ace.read_others(release(15, k));
    release_begins.arrive_and_wait();
    release_ends.arrive_and_wait();
  }
  head_job.join();
  ground_job.join();
  CHECK(head == expected_head);
  CHECK(ground == expected_ground);
  // The slow camera does not wait for the fast one: its pose is known long before, every frame was there.
  CHECK(ace.ground_camera->rendered_ahead() == ground.size());
  CHECK(ace.ground_camera->cost().in_read_ns == 0);
  CHECK(ace.head_camera->rendered_ahead() > 0);
  const auto threads = test::own_threads();
  CHECK(threads.count("sim:head_camera") == 1);
  CHECK(threads.count("sim:ground_came") == 1);
}

TEST_CASE("an exposure far ahead is rendered once, when no command can change it any more") {
  MonotonicClock clock;
  const int64_t epoch = clock.now_ns() + 3'600'000'000'000;  // nothing becomes due during the test
  const auto s = test::small_simulation();
  SimBase base("base", {}, *s);
  SimCamera camera("camera", {test::small_rig(), {}, {5, 1}, true}, *s, clock);
  REQUIRE(base.open().has_value());
  REQUIRE(camera.open().has_value());
  REQUIRE(base.start(epoch).has_value());
  REQUIRE(camera.start(epoch).has_value());
  CHECK(s->settled(true, epoch + 200'000'000));  // nobody moves anything yet
  (void)base.read(epoch, INT64_MAX);
  CHECK(s->settled(true, epoch + 100'000'000));
  CHECK_FALSE(s->settled(true, epoch + 200'000'000));
  camera.trigger(epoch + 200'000'000);
  base.command(0.5, 0.3, epoch);
  CHECK_FALSE(camera.idle());
  (void)base.read(epoch + 67'000'000, INT64_MAX);
  CHECK_FALSE(camera.idle());
  (void)base.read(epoch + 133'000'000, INT64_MAX);
  CHECK(s->settled(true, epoch + 200'000'000));
  while (!camera.idle()) std::this_thread::yield();
  CHECK(s->robot(epoch + 200'000'000).speed_m_s > 0.05);
  CHECK(read(camera).frame.stamp_ns == epoch + 200'000'000);
  CHECK(camera.rendered_ahead() == 1);
  CHECK(camera.cost().in_read_ns == 0);
}

TEST_CASE("asked for another exposure, the thread lets go of the one it waits for") {
  MonotonicClock clock;
  const int64_t epoch = clock.now_ns() + 3'600'000'000'000;
  const auto s = test::small_simulation();
  SimBase base("base", {}, *s);
  SimCamera camera("camera", {test::small_rig(), {}, {5, 1}, true}, *s, clock);
  REQUIRE(camera.open().has_value());
  REQUIRE(base.start(epoch).has_value());
  REQUIRE(camera.start(epoch).has_value());
  (void)base.read(epoch, INT64_MAX);
  camera.trigger(epoch + 200'000'000);
  camera.trigger(epoch + 50'000'000);
  while (!camera.idle()) std::this_thread::yield();
  CHECK(read(camera).frame.stamp_ns == epoch + 50'000'000);
  CHECK(camera.rendered_ahead() == 1);
}

TEST_CASE("a camera that waits for the world to settle stops at once") {
  MonotonicClock clock;
  const int64_t epoch = clock.now_ns() + 3'600'000'000'000;
  const auto s = test::small_simulation();
  SimBase base("base", {}, *s);
  SimCamera camera("camera", {test::small_rig(), {}, {5, 1}, true}, *s, clock);
  REQUIRE(camera.open().has_value());
  REQUIRE(base.start(epoch).has_value());
  REQUIRE(camera.start(epoch).has_value());
  (void)base.read(epoch, INT64_MAX);
  camera.trigger(epoch + 200'000'000);
  camera.stop();
  CHECK(camera.cost().ahead_ns == 0);
  REQUIRE(camera.start(epoch).has_value());
  CHECK(expose(camera, epoch + 50'000'000).frame.frame_number == 0);
}
