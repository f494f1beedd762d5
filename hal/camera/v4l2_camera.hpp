// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "hal/camera/frame_codec.hpp"
#include "hal/camera/frame_trigger.hpp"
#include "hal/camera/rig.hpp"
#include "hal/camera/stereo_camera.hpp"
#include "hal/camera/video_device.hpp"
#include "hal/stream/descriptor.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt::v4l2 {

struct V4l2CameraSettings {
  std::string path;
  StereoRig rig;                  ///< its width and height are those of one eye
  FrameLayout layout;             ///< format, eyes and mosaic; the rest is the rig's and the device's
  Rate rate{15, 1};               ///< asked for; the device may give another
  uint32_t buffers = 4;           ///< asked for, 2..8
  double exposure_s = 0;          ///< 0: as the device is set
  double longest_exposure_s = 0;  ///< of an automatic exposure; 0: a whole period, as long as it can take
  double transfer_s = 0;          ///< at most, from its end until the frame is here; 0: a whole period
  double gain = -1;               ///< in the device's own steps; below 0: as it is set
  double stamp_delay_s = 0;       ///< from the begin of the exposure to the device's stamp
  bool dmabuf = false;            ///< buffers are exported, and lent until the next frame
};

/// What was lost on the way.
struct V4l2Counters {
  uint64_t frames = 0;       ///< delivered
  uint64_t missing = 0;      ///< gaps in the device's count
  uint64_t skipped = 0;      ///< older than one that was there, too, or than the start
  uint64_t damaged = 0;      ///< flagged by the device, or short
  uint64_t repeated = 0;     ///< the same frame again
  uint64_t untriggered = 0;  ///< of no pulse of the trigger
  uint64_t io_errors = 0;    ///< a buffer could not be had
  uint64_t unstamped = 0;    ///< frames whose device has no monotonic stamp: stamped when they were taken
};

/// A stereo camera behind Video4Linux: frames are streamed into buffers that the device's driver shares, and moved from
/// there into the message. Of several frames that wait the newest is delivered.
///
/// It runs at a rate of its own, or exposes when its trigger line rises: a read gives the pulse that trigger() asked
/// for and delivers what is there by its deadline, mostly the frame of the pulse before. Such a frame has its pulse's
/// number and stamp, a pulse without a frame is missing, a frame without a pulse is left out.
class V4l2Camera final : public StereoCamera {
 public:
  static constexpr uint32_t kMostBuffers = 8;
  static constexpr int kIoErrorsToLoss = 3;  ///< in a row (D-8)

  /// Without a trigger it runs at its own rate.
  V4l2Camera(std::string id, V4l2CameraSettings settings, std::unique_ptr<VideoDevice> device, const Clock& clock,
             std::unique_ptr<FrameTrigger> trigger = nullptr);
  ~V4l2Camera() override { V4l2Camera::close(); }
  /// Of the settings alone, what open() would refuse.
  DeviceResult check_settings() const;
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  bool restart(int64_t now_ns) override;
  DeclaredCalls declared_calls() const override;
  SourceCounts counts() const override;
  const char* trouble() const override;
  /// At a rate of its own: exposure, transfer and a period. Triggered: its jobs wait for the first two.
  StampLaw stamp_law(const JobTimes&) const override;
  StereoFormat format() const override;
  void trigger(int64_t at_ns) override;
  /// disconnected: the device is gone, its queue has an error, or it gave nothing for three periods and a second.
  StereoFrame read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) override;

  const V4l2Counters& counters() const { return counters_; }

  /// With `dmabuf`: the buffers, for import by a GPU, an encoder, another process. They are others after a restart.
  std::span<const Descriptor> exported() const { return std::span(exported_).first(buffer_count_); }
  /// Which of them holds the frame that was delivered last: nobody writes it before the read that delivers the next
  /// one, a restart or the stop. -1: none.
  int lent() const { return lent_; }

 private:
  /// What went wrong in words, with an errno where there is one. No allocation: a job may make it.
  struct Trouble {
    const char* what = nullptr;
    int error = 0;
    enum class Of : uint8_t { device, trigger, export_ } of = Of::device;
    explicit operator bool() const { return what != nullptr; }
  };
  struct Frame {
    uint32_t index = 0;
    size_t bytes = 0;
    uint32_t sequence = 0;
    int64_t stamp_ns = 0;
    bool flagged = false;
  };

  Trouble claim();
  Trouble negotiate();
  Trouble set_control(uint32_t control, int32_t value, const char* what);
  Trouble map_buffers();
  Trouble export_buffer(uint32_t index);
  void release();
  Trouble stream();
  DeviceResult told(const Trouble& trouble);
  std::string offered_formats();

  bool queue(uint32_t index);
  bool give_back(uint32_t index);
  enum class Taken : uint8_t { frame, none, lost };
  Taken take_one(Frame& frame);
  Taken take_newest(Frame& frame);
  StereoFrame deliver(const Frame& frame, ImageView<uint8_t> left, ImageView<uint8_t> right);
  bool awaits_another(const Frame& frame) const;
  short wait(int64_t deadline_ns);
  StereoFrame lose();
  bool match(Frame& frame);
  uint64_t* left_out(Frame& frame);
  bool repeats(const Frame& frame) const;
  void count(const Frame& frame);

  std::string id_;
  V4l2CameraSettings settings_;
  std::unique_ptr<VideoDevice> device_;
  std::unique_ptr<FrameTrigger> trigger_;
  const Clock& clock_;
  double rate_hz_ = 0;
  std::array<std::span<const uint8_t>, kMostBuffers> buffers_;
  std::array<Descriptor, kMostBuffers> exported_;
  uint32_t buffer_count_ = 0;
  std::vector<uint8_t> left_mosaic_, right_mosaic_;
  V4l2Counters counters_;
  bool open_ = false, streaming_ = false, lost_ = false, any_ = false, counts_itself_ = false;
  int io_errors_in_row_ = 0, untriggered_in_row_ = 0, lent_ = -1;
  int64_t epoch_ns_ = 0, alive_ns_ = 0;
  uint32_t first_sequence_ = 0, number_ = 0;
  Frame last_;  ///< taken
};

}  // namespace takt::v4l2
