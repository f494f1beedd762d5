// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "hal/camera/frame_codec.hpp"
#include "hal/camera/video_device.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt::v4l2 {

enum class VideoMisbehaviour : uint8_t {
  none,
  silent,         ///< exposes nothing
  unplugged,      ///< every call says ENODEV; with none it is there again, but must be opened anew
  flagged,        ///< V4L2_BUF_FLAG_ERROR
  cut,            ///< half of each frame
  empty,          ///< no byte of a frame
  io_error,       ///< EIO instead of a buffer
  end_of_stream,  ///< EPIPE instead of a buffer
  queue_error,    ///< the queue is in error: POLLERR, and no buffer
  repeated,       ///< the frame before again, number, stamp and all
  uncounted,      ///< the number is 0 for ever
  unstamped,      ///< no monotonic stamps
  frozen          ///< the same picture, well numbered and stamped
};

/// A camera behind the calls of a V4L2 driver: exposes at its rate from STREAMON on, into the buffers that are queued,
/// and loses frames as a driver does when none is. `fill` writes frame number k into a buffer.
class VideoDouble {
 public:
  using Fill = std::function<void(uint32_t k, std::span<uint8_t> frame)>;
  struct Settings {
    uint32_t width = 0, height = 0, code = 0;  ///< of the whole frame; code: four_characters
    uint32_t bytes_per_line = 0, frame_bytes = 0;
    Rate rate{15, 1};
    bool has_controls = true;
  };
  VideoDouble(Settings settings, Fill fill, const Clock& clock)
      : settings_(settings), fill_(std::move(fill)), clock_(clock) {}

  /// What a driver opens. The double must outlive it.
  std::unique_ptr<VideoDevice> device();
  void misbehave(VideoMisbehaviour how) { how_ = how; }
  int32_t exposure_steps() const { return exposure_; }
  int32_t gain_steps() const { return gain_; }

 private:
  friend class VideoDoubleFile;
  static constexpr uint32_t kMostBuffers = 8;
  struct Buffer {
    std::vector<uint8_t> bytes;
    enum class State : uint8_t { idle, queued, done } state = State::idle;
    uint32_t sequence = 0, flags = 0, bytes_used = 0;
    int64_t stamp_ns = 0;
  };

  int control(unsigned long request, void* argument);
  int allocate(void* argument);
  int dequeue(void* argument);
  int set(void* argument);
  /// Exposes all that is due.
  void live();
  void expose(Buffer& buffer, uint32_t k, int64_t at_ns);
  Buffer* oldest_done();
  bool away() const { return how_ == VideoMisbehaviour::unplugged; }

  Settings settings_;
  Fill fill_;
  const Clock& clock_;
  VideoMisbehaviour how_ = VideoMisbehaviour::none;
  std::array<Buffer, kMostBuffers> buffers_;
  uint32_t count_ = 0;
  bool opened_ = false, streaming_ = false;
  int64_t streaming_since_ns_ = 0;
  uint32_t exposed_ = 0;  ///< frames since STREAMON
  uint32_t last_k_ = 0;   ///< the newest that was told
  uint32_t picture_ = 0;  ///< the newest that was filled in
  int64_t last_stamp_ns_ = 0;
  int32_t exposure_ = 0, gain_ = 0;
};

}  // namespace takt::v4l2
