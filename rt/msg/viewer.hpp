// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/viewer.hpp>: core, experimental.
// How a message looks to programs that do not know its type. A message says so itself, next to its fields:
//
//   struct Thermogram {
//     ...
//     void show(takt::Viewer& to) const { to.picture({pixels.data(), width, height}); }
//   };
//
// `takt echo --png` and `--ply`, and `takt log export` for Foxglove, then show it. A message without show() is shown by
// its fields. Only a message that is sound() is shown.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"

namespace takt {

/// What a message shows of itself, in as many calls as it likes. What was given is valid during the call. A viewer
/// leaves out what it has no use for. Called outside of jobs, in any thread.
class Viewer {
 public:
  struct Scan {
    double first_angle_rad = 0, step_rad = 0;  ///< counter-clockwise from the sensor's forward axis
    std::span<const float> range_m;            ///< 0: no return
    double max_range_m = 0, sweep_s = 0;       ///< 0: not known
  };
  struct Cells {
    ImageView<const int16_t> cells;  ///< 0 free .. 1000 occupied, -1 unknown
    double cell_m = 0;
    double origin_x_m = 0, origin_y_m = 0;  ///< corner of cell (0, 0) in the robot frame
  };

  /// How the pixels of a picture lie in space.
  struct Camera {
    CameraModel model;
    int width = 0, height = 0;
    double right_of_first_m = 0;  ///< of the second camera of a rectified pair: its baseline
  };
  /// An object, a person: something that has a place.
  struct Thing {
    std::string name;
    Transform pose;                                  ///< the middle of its box
    double length_m = 0, width_m = 0, height_m = 0;  ///< of the box, along x, y, z of its pose; 0: not known
    double confidence = 1;                           ///< 0..1
  };

  virtual ~Viewer() = default;
  /// Grey if it has one channel, BGR if three. `part` tells several pictures of a message apart: "left".
  virtual void picture(const ImageView<const uint8_t>&, std::string_view part = "") { static_cast<void>(part); }
  /// px, 0 .. disparities - 1; negative: none.
  virtual void disparity(const ImageView<const int16_t>&, int disparities) { static_cast<void>(disparities); }
  /// m, in the frame of the sensor. As many colours as points, or fewer: the others have none.
  virtual void cloud(std::span<const Point>, std::span<const Colour>) {}
  virtual void scan(const Scan&) {}
  virtual void grid(const Cells&) {}
  /// Of the thing that the message is about, in a frame: "map".
  virtual void pose(const Transform&, std::string_view frame) { static_cast<void>(frame); }
  virtual void text(std::string_view) {}
  /// Where the sensor sits on the robot.
  virtual void mounted(const Transform& sensor_in_robot) { static_cast<void>(sensor_in_robot); }
  /// Of the picture that has the same `part`. Only said of rectified pictures.
  virtual void camera(const Camera&, std::string_view part = "") { static_cast<void>(part); }
  /// All things that the message is about, in a frame: "robot". Its fields say more of them.
  virtual void things(std::span<const Thing>, std::string_view frame) { static_cast<void>(frame); }
};

}  // namespace takt
