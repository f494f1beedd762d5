// SPDX-License-Identifier: Apache-2.0
// A stereo camera on FireWire (IIDC) behind the calls of a V4L2 driver: Linux has no V4L2 driver for such cameras.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hal/camera/iidc/dc1394_calls.hpp"
#include "hal/camera/video_device.hpp"
#include "rt/time/clock.hpp"

namespace takt::iidc {

/// Which two of three sensors a Bumblebee XB3 sends (register PAN): those farthest apart, or two neighbours. On a
/// Bumblebee2 they are its two in one order or the other.
enum class Eyes : uint8_t { wide = 0, narrow = 1 };

struct IidcSettings {
  uint64_t guid = 0;  ///< 0: the only one that there is
  std::optional<Eyes> eyes;
  bool triggered = false;  ///< exposes at an edge of its pin 0 (mode 0); else at its own rate
  bool falling = false;    ///< at the falling edge
};

/// Format 7, mode 3: all sensors at one instant, a byte of each in every pixel. V4L2's words become libdc1394's calls:
///
///   VIDIOC_S_FMT    mode, coding (Y16: RAW16 or MONO16, RGB3: RGB8), size
///   VIDIOC_S_PARM   bytes of a packet: a packet each 125 us, so many of them a frame
///   VIDIOC_S_CTRL   shutter in 100 us, gain in the camera's steps
///   VIDIOC_DQBUF    the oldest frame of the ring, copied into a buffer of its own; its stamp, of the end of the
///   transfer, less
///                   the transfer: the end of the exposure
///
/// The camera does not count its frames: numbers come from the stamps and the period.
class IidcVideoDevice final : public v4l2::VideoDevice {
 public:
  /// CLOCK_REALTIME, in which the library stamps.
  using RealTime = std::function<int64_t()>;
  /// `calls`: null where the library is missing, which open() then says.
  IidcVideoDevice(const IidcSettings& settings, const Dc1394Calls* calls, const Clock& clock, RealTime real_time = {});
  ~IidcVideoDevice() override { close(); }

  /// ELIBACC: without the library; ENODEV: there is no such camera; ENOTUNIQ: there are several, and no `guid`.
  int open(const std::string& path) override;
  void close() override;
  int control(unsigned long request, void* argument) override;
  std::span<const uint8_t> map(size_t bytes, uint32_t index) override;
  void unmap(std::span<const uint8_t>) override {}
  short wait(int64_t timeout_ns) override;
  bool allocates() const override { return true; }  ///< where it is opened again

 private:
  static constexpr uint32_t kMostBuffers = 8, kRing = 4;
  static constexpr double kPacket_s = 125e-6;  ///< from one to the next
  static constexpr dc1394video_mode_t kMode = DC1394_VIDEO_MODE_FORMAT7_3;
  struct Buffer {
    std::vector<uint8_t> bytes;
    bool queued = false;
  };

  int find_camera();
  int prepare();
  int set_trigger();
  int offer(void* argument);
  int set_format(void* argument);
  int set_rate(void* argument);
  int set_control(void* argument);
  int set_shutter(double s);
  int allocate(void* argument);
  int begin();
  void end();
  int take(void* argument);
  uint32_t number_of(uint64_t stamp_us);
  std::vector<dc1394color_coding_t> codings() const;

  const IidcSettings settings_;
  const Dc1394Calls* calls_;
  const Clock& clock_;
  const RealTime real_time_;
  dc1394_t* library_ = nullptr;
  dc1394camera_t* camera_ = nullptr;
  std::array<Buffer, kMostBuffers> buffers_;
  uint32_t buffer_count_ = 0;
  uint32_t width_ = 0, height_ = 0, bytes_per_pixel_ = 2;
  uint64_t frame_bytes_ = 0;  ///< with the padding of its last packet
  uint32_t packets_ = 1;      ///< of a frame
  bool streaming_ = false;
  std::optional<uint64_t> last_us_;  ///< stamp of the frame before
  uint32_t number_ = 0;
};

}  // namespace takt::iidc
