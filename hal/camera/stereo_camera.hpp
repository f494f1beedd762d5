// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"

namespace takt {

/// What a stereo camera will deliver; fixed by open().
struct StereoFormat {
  int width = 0, height = 0;
  int channels = 0;           ///< 1 grey, 3 BGR interleaved
  bool rectified = false;     ///< rows of left and right correspond; `camera` is valid
  CameraModel camera;         ///< zero unless rectified
  double rate_hz = 0;         ///< 0: exposes at the instant of trigger(); else at a rate of its own
  Transform sensor_in_robot;  ///< left camera, head at rest; identity: unknown
};

/// One exposure as the device reports it.
struct StereoFrame {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;       ///< start of exposure
  uint32_t frame_number = 0;  ///< counted by the device; a gap is a frame lost before the host saw it
  uint32_t health = 0;        ///< bits of takt::image_health that the driver itself knows (partial)
};

/// A stereo camera (Bumblebee XB3 and X2 through a V4L2 bridge, a file source, the simulator). See Device for
/// the life cycle and the thread rules.
class StereoCamera : public Device {
 public:
  /// Valid after open().
  virtual StereoFormat format() const = 0;

  /// Asks a triggered camera to expose at `at_ns` (the planned release). A free-running camera ignores it. At most one
  /// trigger may be pending; the runtime triggers once a release, before the read of that release.
  virtual void trigger(int64_t at_ns) = 0;

  /// Moves the next exposure into the caller's views (the shared memory of the message: one copy, straight from
  /// the capture buffer). Views must have the size of format(). Returns as soon as a frame is there and at the latest
  /// at `deadline_ns`; a deadline in the past makes it a poll. Frames are delivered in order, each once.
  virtual StereoFrame read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) = 0;
};

}  // namespace takt
