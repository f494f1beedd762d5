// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "hal/camera/frame_codec.hpp"
#include "hal/camera/video_double.hpp"
#include "hal/device_double.hpp"
#include "rt/time/rate.hpp"

namespace takt::v4l2 {

/// A camera behind the kernel's v4l2loopback: writes the frames that whoever captures from that device is given. Where
/// it takes longer to fill a frame than its period is, frames are left out. Unplugged, it leaves the device, which then
/// nobody can open for capture; who streams already only hears nothing more: the module knows no disconnection.
class LoopbackDouble final : public DeviceDouble {
 public:
  struct Settings {
    std::string path;    ///< /dev/video0
    FrameLayout layout;  ///< rows without padding, whatever it says
    Rate rate{15, 1};
  };
  LoopbackDouble(Settings settings, VideoDouble::Fill fill);
  ~LoopbackDouble() override;

  DeviceResult plug_in() override;
  /// The first frame is due at the first call, the others whole periods later; of several that are due the newest is
  /// written.
  void run_to(int64_t now_ns) override;
  std::span<const Misbehaviour> known() const override;
  void misbehave(Misbehaviour how) override;

 private:
  void leave();

  Settings settings_;
  VideoDouble::Fill fill_;
  std::vector<uint8_t> frame_;
  Misbehaviour how_ = Misbehaviour::none;
  int descriptor_ = -1;
  int64_t origin_ns_ = 0, next_ = 0;  ///< of the first frame; number of the next one
};

}  // namespace takt::v4l2
