// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "hal/camera/frame_codec.hpp"
#include "hal/camera/video_device.hpp"
#include "hal/device_double.hpp"
#include "hal/gpio/chip_double.hpp"
#include "hal/stream/descriptor.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt::v4l2 {

/// A camera behind the calls of a V4L2 driver: exposes at its rate, or when its trigger line rises, into the buffers
/// that are queued, and loses frames as a driver does when none is. A frame is there when its exposure has been
/// written, however long that takes. While it reads out, for nine tenths of a period, it does not see its trigger.
///
/// In virtual time it lives in the calls that are made of it. Else run_to() is called by a thread of its own: buffers
/// go from hand to hand by their state, and a driver that waits is woken through a descriptor.
class VideoDouble final : public DeviceDouble {
 public:
  /// Writes frame number k, exposed at that instant.
  using Fill = std::function<void(uint32_t k, int64_t at_ns, std::span<uint8_t> frame)>;
  struct Settings {
    uint32_t width = 0, height = 0, code = 0;  ///< of the whole frame; code: four_characters
    uint32_t bytes_per_line = 0, frame_bytes = 0;
    Rate rate{15, 1};
    bool has_controls = true;
    bool exports = true;         ///< buffers as DMABUFs
    std::string trigger_line{};  ///< the name of its line; empty: it runs at its rate
  };
  VideoDouble(Settings settings, Fill fill, const Clock& clock);
  ~VideoDouble() override;

  /// What a driver opens. The double must outlive it.
  std::unique_ptr<VideoDevice> device();
  /// The chip whose only line is its trigger.
  gpio::ChipDouble& wire() { return wire_; }
  /// One exposure is then, as by a trigger; the others lie whole periods from it. Else the first is at STREAMON.
  void expose_at(int64_t instant_ns) { trigger_ns_.store(instant_ns); }
  DeviceResult plug_in() override { return {}; }
  void run_to(int64_t now_ns) override;
  std::span<const Misbehaviour> known() const override;
  void misbehave(Misbehaviour how) override;
  int32_t exposure_steps() const { return exposure_; }
  int32_t gain_steps() const { return gain_; }

 private:
  friend class VideoDoubleFile;
  static constexpr uint32_t kMostBuffers = 8;
  /// `idle` and `done` belong to the driver, `queued` to the camera, which `exposes` it.
  enum class State : uint8_t { idle, queued, exposes, done };
  struct Buffer {
    Descriptor memory;  ///< what an export is of
    std::span<uint8_t> bytes;
    std::atomic<State> state{State::idle};
    uint32_t sequence = 0, flags = 0, bytes_used = 0;
    int64_t stamp_ns = 0;
  };

  int control(unsigned long request, void* argument);
  int allocate(void* argument);
  int enqueue(uint32_t index);
  int dequeue(void* argument);
  int set(void* argument);
  int export_buffer(void* argument);
  void stream_on();
  void stream_off();
  /// In virtual time, before a call: exposes all that is due.
  void live();
  void begin_stream(int64_t since_ns);
  void expose_next(int64_t at_ns);
  void expose(Buffer& buffer, uint32_t k, int64_t at_ns);
  Buffer* oldest_done();
  Misbehaviour how() const { return how_.load(std::memory_order_relaxed); }
  bool away() const { return how() == Misbehaviour::unplugged; }

  Settings settings_;
  Fill fill_;
  const Clock& clock_;
  std::atomic<Misbehaviour> how_{Misbehaviour::none};
  std::array<Buffer, kMostBuffers> buffers_;
  std::atomic<int64_t> trigger_ns_{INT64_MIN};
  std::atomic<int64_t> streaming_since_ns_{INT64_MIN};         ///< INT64_MIN: it does not
  int wakes_ = -1;                                             ///< readable once for each frame that is done
  std::array<std::atomic<int64_t>, kMostBuffers> rises_ns_{};  ///< of the trigger line, the newest ones
  std::atomic<uint32_t> rises_{0};

  // Of the driver's thread.
  uint32_t count_ = 0;
  bool opened_ = false;
  int32_t exposure_ = 0, gain_ = 0;

  // Of the thread that runs it.
  int64_t stream_ns_ = INT64_MIN;  ///< the stream that these belong to
  int64_t origin_ns_ = 0, next_ = 0, first_ = 0;
  uint32_t risen_ = 0;                   ///< rises that were looked at
  int64_t sees_trigger_ns_ = INT64_MIN;  ///< from then on
  uint32_t last_k_ = 0;                  ///< the newest that was told
  uint32_t picture_ = 0;                 ///< the newest that was filled in
  int64_t last_stamp_ns_ = 0, picture_ns_ = 0;

  gpio::ChipDouble wire_;
};

}  // namespace takt::v4l2
