// SPDX-License-Identifier: Apache-2.0
// What the doubles of devices see and move, where they stand on the robot of a simulated world. All of them see one
// world; each of the mechanisms is moved by one double. The world's time must have begun before a double lives.
#pragma once
#include "hal/base/base_double.hpp"
#include "hal/camera/rig.hpp"
#include "hal/camera/video_double.hpp"
#include "hal/gpio/chip_double.hpp"
#include "hal/head/head_double.hpp"
#include "hal/laser/range_source.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::doubles {

/// A scanner that is mounted there (yaw only: the world is scanned in a plane), with noise of 5 mm (D-1.9).
RangeSource ranges_in(const sim::Simulation& world, const Transform& sensor_in_robot);

/// The head of the world: acts at once, at the world's accelerations.
head::Neck neck_in(sim::Simulation& world);

/// The base of the world: it drives the world's path, whatever it is told, or obeys. Its wheels slip as those of the
/// simulated base do.
base::Body body_in(sim::Simulation& world);

/// The digital lines of the world; all low until its time has begun.
gpio::LevelSource levels_in(const sim::Simulation& world);

/// The frames of a stereo camera: rendered as the simulated camera renders them, brought into the layout of its driver.
/// What that costs counts as the simulator's. The layout must be one that v4l2::join() can make, at the rig's size.
v4l2::VideoDouble::Fill frames_in(const sim::Simulation& world, StereoRig rig, const v4l2::FrameLayout& layout);

}  // namespace takt::doubles
