// SPDX-License-Identifier: Apache-2.0
#include "hal/doubles/in_world.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "hal/sim/lens.hpp"
#include "hal/sim/random.hpp"
#include "hal/sim/sensors.hpp"

namespace takt::doubles {
namespace {

bool began(const sim::Simulation& world) { return world.epoch_ns() != std::numeric_limits<int64_t>::min(); }

/// The world carries commands out kLatencyNs after they were given: given then, they act now.
int64_t acting(int64_t now_ns) { return now_ns - sim::kLatencyNs; }

/// Two eyes, and what is needed to draw what they see.
struct Eyes {
  StereoRig rig;
  v4l2::FrameLayout layout;
  sim::Lens lens;
  sim::Snapshot met;
  std::vector<uint8_t> left, right;
  sim::CostCounter cost;

  Eyes(const sim::Simulation& world, const StereoRig& rig_, const v4l2::FrameLayout& layout_)
      : rig(rig_),
        layout(layout_),
        lens(rig_),
        met(world.make_snapshot()),
        left(static_cast<size_t>(rig_.width) * static_cast<size_t>(rig_.height) * static_cast<size_t>(rig_.channels)),
        right(left) {}
  ImageView<uint8_t> image(int eye) {
    return {eye == 0 ? left.data() : right.data(), rig.width, rig.height, rig.channels};
  }
};

}  // namespace

RangeSource ranges_in(const sim::Simulation& world, const Transform& sensor_in_robot) {
  return [&world, sensor_in_robot, met = world.make_snapshot()](const Sweep& sweep, std::span<float> range_m) mutable {
    sim::LaserModel model;
    model.beams = static_cast<uint32_t>(range_m.size());
    model.fov_rad = sweep.step_rad * static_cast<double>(range_m.size() - 1);
    model.sweep_s = sweep.sweep_s;
    model.max_range_m = 80;
    model.sigma_m = 0.005;
    // The middle of the sweep looks ahead, in the scanner's own plane.
    const Transform& t = sensor_in_robot;
    const double half = (sweep.first_angle_rad + model.fov_rad / 2) / 2, c = std::cos(half), s = std::sin(half);
    model.sensor_in_robot = {
        t.x, t.y, t.z, t.qw * c - t.qz * s, t.qx * c + t.qy * s, t.qy * c - t.qx * s, t.qw * s + t.qz * c};
    sim::scan(world, model, sweep.first_ns, range_m, met);
  };
}

head::Neck neck_in(sim::Simulation& world) {
  return [&world](const std::optional<std::array<double, 2>>& target_rad, const std::array<Axis, 2>&, int64_t now_ns,
                  head::Axes& axes) {
    const HeadReading before = world.head(now_ns);
    const auto wanted = target_rad.value_or(std::array{before.pan_rad, before.tilt_rad});
    world.command_head(wanted[0], wanted[1], acting(now_ns));
    world.advance_head(acting(now_ns));
    const HeadReading now = world.head(now_ns);
    axes = {{now.pan_rad, now.tilt_rad}, {now.pan_rad_s, now.tilt_rad_s}};
  };
}

base::Body body_in(sim::Simulation& world) {
  return [&world, odometry = sim::DriftingOdometry(world, {}, world.seed()), before = std::optional<BaseReading>()](
             const base::Drive& drive, int64_t now_ns) mutable {
    if (world.drive() == sim::Drive::command) {
      world.command_base(drive.speed_m_s, drive.turn_rad_s, acting(now_ns));
      world.advance_base(acting(now_ns));
    }
    const BaseReading now = odometry.at(now_ns);
    const BaseReading from = before.value_or(now);
    before = now;
    base::Advance moved;
    moved.turn_rad = std::remainder(now.theta_rad - from.theta_rad, 2 * std::numbers::pi);
    const double middle = from.theta_rad + moved.turn_rad / 2;
    moved.forward_m = (now.x_m - from.x_m) * std::cos(middle) + (now.y_m - from.y_m) * std::sin(middle);
    moved.speed_m_s = now.speed_m_s;
    moved.turn_rad_s = now.turn_rad_s;
    moved.blocked = now.blocked;
    return moved;
  };
}

gpio::LevelSource levels_in(const sim::Simulation& world) {
  return [&world](int64_t at_ns) { return began(world) ? world.lines(at_ns) : 0u; };
}

v4l2::VideoDouble::Fill frames_in(const sim::Simulation& world, StereoRig rig, const v4l2::FrameLayout& layout) {
  world.scene().textures->make();
  rig.channels = layout.mosaic == v4l2::Mosaic::none ? 1 : 3;
  return
      [&world, eyes = std::make_shared<Eyes>(world, rig, layout)](uint32_t, int64_t at_ns, std::span<uint8_t> frame) {
        const int64_t before_ns = thread_cpu_ns();
        const uint64_t exposure = sim::mix(world.seed(), static_cast<uint64_t>(at_ns - world.epoch_ns()));
        world.look(at_ns, eyes->met);
        for (const int eye : {0, 1}) {
          eyes->lens.render(eyes->met.scene, world.camera_pose(eyes->rig, eye, at_ns), {},
                            sim::mix(exposure, static_cast<uint64_t>(eye) + 1), eyes->image(eye));
        }
        v4l2::join(eyes->image(0), eyes->image(1), eyes->layout, frame);
        eyes->cost.add({thread_cpu_ns() - before_ns, 0});
      };
}

}  // namespace takt::doubles
