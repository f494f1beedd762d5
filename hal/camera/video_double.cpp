// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/video_double.hpp"

#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace takt::v4l2 {

/// One open file of the double.
class VideoDoubleFile final : public VideoDevice {
 public:
  explicit VideoDoubleFile(VideoDouble& camera) : camera_(camera) {}
  ~VideoDoubleFile() override { VideoDoubleFile::close(); }
  int open(const std::string&) override {
    if (camera_.away()) return ENODEV;
    if (camera_.opened_) return EBUSY;
    open_ = camera_.opened_ = true;
    gone_ = false;
    return 0;
  }
  void close() override {
    if (!open_) return;
    open_ = camera_.opened_ = camera_.streaming_ = false;
    camera_.count_ = 0;
  }
  int control(unsigned long request, void* argument) override {
    if (camera_.away()) gone_ = true;
    if (!open_ || gone_) return ENODEV;
    return camera_.control(request, argument);
  }
  std::span<const uint8_t> map(size_t bytes, uint32_t offset) override {
    if (offset >= camera_.count_ || bytes > camera_.buffers_[offset].bytes.size()) return {};
    return std::span(camera_.buffers_[offset].bytes).first(bytes);
  }
  void unmap(std::span<const uint8_t>) override {}
  short wait(int64_t) override {  // virtual time stands while somebody waits
    if (!open_ || gone_ || camera_.away()) return POLLERR | POLLHUP;
    if (camera_.how_ == VideoMisbehaviour::queue_error) return POLLERR;
    camera_.live();
    return camera_.oldest_done() != nullptr ? POLLIN : static_cast<short>(0);
  }

 private:
  VideoDouble& camera_;
  bool open_ = false;
  bool gone_ = false;  ///< it was unplugged while open
};

std::unique_ptr<VideoDevice> VideoDouble::device() { return std::make_unique<VideoDoubleFile>(*this); }

int VideoDouble::control(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      capability.capabilities = V4L2_CAP_DEVICE_CAPS;
      capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& format = *static_cast<v4l2_fmtdesc*>(argument);
      if (format.index > 0) return EINVAL;
      format.pixelformat = settings_.code;
      return 0;
    }
    case VIDIOC_S_FMT: {  // a driver gives what it has
      auto& format = static_cast<v4l2_format*>(argument)->fmt.pix;
      if (count_ > 0) return EBUSY;
      format.width = settings_.width;
      format.height = settings_.height;
      format.pixelformat = settings_.code;
      format.bytesperline = settings_.bytes_per_line;
      format.sizeimage = settings_.frame_bytes;
      return 0;
    }
    case VIDIOC_S_PARM:
      static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {
          static_cast<uint32_t>(settings_.rate.denominator), static_cast<uint32_t>(settings_.rate.numerator)};
      return 0;
    case VIDIOC_S_CTRL: return set(argument);
    case VIDIOC_REQBUFS: return allocate(argument);
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= count_) return EINVAL;
      buffer.length = settings_.frame_bytes;
      buffer.m.offset = buffer.index;
      return 0;
    }
    case VIDIOC_QBUF: {
      live();
      const auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= count_ || buffers_[buffer.index].state != Buffer::State::idle) return EINVAL;
      buffers_[buffer.index].state = Buffer::State::queued;
      return 0;
    }
    case VIDIOC_DQBUF: return dequeue(argument);
    case VIDIOC_STREAMON:
      streaming_ = true;
      streaming_since_ns_ = clock_.now_ns();
      exposed_ = 0;
      return 0;
    case VIDIOC_STREAMOFF:
      streaming_ = false;
      for (Buffer& buffer : buffers_) buffer.state = Buffer::State::idle;
      return 0;
    default: return ENOTTY;
  }
}

int VideoDouble::set(void* argument) {
  const auto& wanted = *static_cast<v4l2_control*>(argument);
  if (!settings_.has_controls) return EINVAL;
  if (wanted.id == V4L2_CID_EXPOSURE_ABSOLUTE) exposure_ = wanted.value;
  if (wanted.id == V4L2_CID_GAIN) gain_ = wanted.value;
  return 0;
}

int VideoDouble::allocate(void* argument) {
  auto& request = *static_cast<v4l2_requestbuffers*>(argument);
  request.count = count_ = std::min(request.count, kMostBuffers);
  for (uint32_t i = 0; i < count_; ++i) {
    buffers_[i] = {};
    buffers_[i].bytes.resize(settings_.frame_bytes);
  }
  return 0;
}

VideoDouble::Buffer* VideoDouble::oldest_done() {
  Buffer* oldest = nullptr;
  for (Buffer& buffer : buffers_) {
    if (buffer.state == Buffer::State::done && (oldest == nullptr || buffer.stamp_ns < oldest->stamp_ns))
      oldest = &buffer;
  }
  return oldest;
}

int VideoDouble::dequeue(void* argument) {
  if (how_ == VideoMisbehaviour::io_error) return EIO;
  if (how_ == VideoMisbehaviour::end_of_stream) return EPIPE;
  if (how_ == VideoMisbehaviour::queue_error) return EAGAIN;
  live();
  Buffer* done = oldest_done();
  if (done == nullptr) return EAGAIN;
  done->state = Buffer::State::idle;
  auto& buffer = *static_cast<v4l2_buffer*>(argument);
  buffer.index = static_cast<uint32_t>(done - buffers_.data());
  buffer.sequence = done->sequence;
  buffer.flags = done->flags;
  buffer.bytesused = done->bytes_used;
  buffer.timestamp.tv_sec = done->stamp_ns / 1'000'000'000;
  buffer.timestamp.tv_usec = done->stamp_ns % 1'000'000'000 / 1000;
  return 0;
}

void VideoDouble::live() {
  if (!streaming_) return;
  for (int64_t at_ns; (at_ns = settings_.rate.release_ns(streaming_since_ns_, exposed_)) <= clock_.now_ns();) {
    const uint32_t k = exposed_++;
    const auto free = std::find_if(buffers_.begin(), buffers_.end(),
                                   [](const Buffer& b) { return b.state == Buffer::State::queued; });
    if (free != buffers_.end() && how_ != VideoMisbehaviour::silent) expose(*free, k, at_ns);
  }
}

void VideoDouble::expose(Buffer& buffer, uint32_t k, int64_t at_ns) {
  const bool again = how_ == VideoMisbehaviour::repeated;
  if (!again) {
    last_k_ = k;
    last_stamp_ns_ = at_ns;
  }
  if (how_ != VideoMisbehaviour::frozen) picture_ = last_k_;
  fill_(picture_, buffer.bytes);
  buffer.state = Buffer::State::done;
  buffer.sequence = how_ == VideoMisbehaviour::uncounted ? 0 : last_k_;
  buffer.stamp_ns = last_stamp_ns_;
  buffer.flags =
      how_ == VideoMisbehaviour::unstamped ? V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (how_ == VideoMisbehaviour::flagged) buffer.flags |= V4L2_BUF_FLAG_ERROR;
  buffer.bytes_used = how_ == VideoMisbehaviour::empty ? 0
                      : how_ == VideoMisbehaviour::cut ? settings_.frame_bytes / 2
                                                       : settings_.frame_bytes;
}

}  // namespace takt::v4l2
