// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/video_double.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

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
    camera_.stream_off();
    open_ = camera_.opened_ = false;
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
  short wait(int64_t timeout_ns) override {
    if (!camera_.clock_.is_virtual()) {  // virtual time stands while somebody waits
      pollfd wakes{camera_.wakes_, POLLIN, 0};
      const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
      if (camera_.oldest_done() == nullptr) ppoll(&wakes, 1, &timeout, nullptr);
    }
    if (!open_ || gone_ || camera_.away()) return POLLERR | POLLHUP;
    if (camera_.how() == Misbehaviour::queue_error) return POLLERR;
    camera_.live();
    return camera_.oldest_done() != nullptr ? POLLIN : static_cast<short>(0);
  }

 private:
  VideoDouble& camera_;
  bool open_ = false;
  bool gone_ = false;  ///< it was unplugged while open
};

VideoDouble::VideoDouble(Settings settings, Fill fill, const Clock& clock)
    : settings_(std::move(settings)),
      fill_(std::move(fill)),
      clock_(clock),
      wakes_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      wire_({settings_.trigger_line}, clock) {
  for (Buffer& buffer : buffers_) {
    buffer.memory = Descriptor(memfd_create("takt-frame", MFD_CLOEXEC));
    void* const bytes =
        ftruncate(buffer.memory.get(), settings_.frame_bytes) != 0
            ? MAP_FAILED
            : mmap(nullptr, settings_.frame_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, buffer.memory.get(), 0);
    if (bytes == MAP_FAILED) throw std::bad_alloc();
    buffer.bytes = {static_cast<uint8_t*>(bytes), settings_.frame_bytes};
  }
  wire_.on_rise([this](uint32_t) {
    const uint32_t rise = rises_.load(std::memory_order_relaxed);
    rises_ns_[rise % kMostBuffers].store(clock_.now_ns(), std::memory_order_relaxed);
    rises_.store(rise + 1, std::memory_order_release);
  });
}

VideoDouble::~VideoDouble() {
  for (const Buffer& buffer : buffers_) munmap(buffer.bytes.data(), buffer.bytes.size());
  ::close(wakes_);
}

std::unique_ptr<VideoDevice> VideoDouble::device() { return std::make_unique<VideoDoubleFile>(*this); }

std::span<const Misbehaviour> VideoDouble::known() const {
  static constexpr std::array kKnown{Misbehaviour::none,      Misbehaviour::silent,        Misbehaviour::unplugged,
                                     Misbehaviour::garbage,   Misbehaviour::frozen,        Misbehaviour::repeated,
                                     Misbehaviour::flagged,   Misbehaviour::cut,           Misbehaviour::empty,
                                     Misbehaviour::io_error,  Misbehaviour::end_of_stream, Misbehaviour::queue_error,
                                     Misbehaviour::uncounted, Misbehaviour::unstamped};
  return kKnown;
}

void VideoDouble::misbehave(Misbehaviour how) {
  how_.store(how);
  eventfd_write(wakes_, 1);  // who waits looks again
}

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
    case VIDIOC_EXPBUF: return export_buffer(argument);
    case VIDIOC_QBUF: live(); return enqueue(static_cast<v4l2_buffer*>(argument)->index);
    case VIDIOC_DQBUF: return dequeue(argument);
    case VIDIOC_STREAMON: stream_on(); return 0;
    case VIDIOC_STREAMOFF: stream_off(); return 0;
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

int VideoDouble::export_buffer(void* argument) {
  auto& request = *static_cast<v4l2_exportbuffer*>(argument);
  if (!settings_.exports) return ENOTTY;
  if (request.index >= count_) return EINVAL;
  request.fd = fcntl(buffers_[request.index].memory.get(), F_DUPFD_CLOEXEC, 0);
  return request.fd >= 0 ? 0 : errno;
}

int VideoDouble::allocate(void* argument) {
  auto& request = *static_cast<v4l2_requestbuffers*>(argument);
  for (const Buffer& buffer : buffers_) {
    if (buffer.state.load() == State::exposes) return EBUSY;  // of a stream that has just ended
  }
  request.count = count_ = std::min(request.count, kMostBuffers);
  for (Buffer& buffer : buffers_) buffer.state.store(State::idle);
  return 0;
}

int VideoDouble::enqueue(uint32_t index) {
  State mine = State::idle;
  return index < count_ && buffers_[index].state.compare_exchange_strong(mine, State::queued) ? 0 : EINVAL;
}

void VideoDouble::stream_on() {
  for (eventfd_t ignored; eventfd_read(wakes_, &ignored) == 0;) {
  }
  streaming_since_ns_.store(clock_.now_ns());
}

void VideoDouble::stream_off() {
  streaming_since_ns_.store(INT64_MIN);
  for (Buffer& buffer : buffers_) {
    State state = buffer.state.load();
    while (state != State::exposes && !buffer.state.compare_exchange_weak(state, State::idle)) {
    }
  }
}

VideoDouble::Buffer* VideoDouble::oldest_done() {
  Buffer* oldest = nullptr;
  for (Buffer& buffer : buffers_) {
    if (buffer.state.load() == State::done && (oldest == nullptr || buffer.stamp_ns < oldest->stamp_ns))
      oldest = &buffer;
  }
  return oldest;
}

int VideoDouble::dequeue(void* argument) {
  if (how() == Misbehaviour::io_error) return EIO;
  if (how() == Misbehaviour::end_of_stream) return EPIPE;
  if (how() == Misbehaviour::queue_error) return EAGAIN;
  live();
  Buffer* done = oldest_done();
  if (eventfd_t ignored; done == nullptr) eventfd_read(wakes_, &ignored);
  if (done == nullptr && (done = oldest_done()) == nullptr) return EAGAIN;
  auto& buffer = *static_cast<v4l2_buffer*>(argument);
  buffer.index = static_cast<uint32_t>(done - buffers_.data());
  buffer.sequence = done->sequence;
  buffer.flags = done->flags;
  buffer.bytesused = done->bytes_used;
  buffer.timestamp.tv_sec = done->stamp_ns / 1'000'000'000;
  buffer.timestamp.tv_usec = done->stamp_ns % 1'000'000'000 / 1000;
  done->state.store(State::idle);
  return 0;
}

void VideoDouble::live() {
  if (clock_.is_virtual()) run_to(clock_.now_ns());
}

void VideoDouble::run_to(int64_t now_ns) {
  const int64_t since_ns = streaming_since_ns_.load();
  if (since_ns == INT64_MIN) return;
  if (stream_ns_ != since_ns) begin_stream(since_ns);
  if (settings_.trigger_line.empty()) {
    for (int64_t at_ns; (at_ns = settings_.rate.release_ns(origin_ns_, next_)) <= now_ns;) expose_next(at_ns);
    return;
  }
  for (; risen_ != rises_.load(std::memory_order_acquire); ++risen_) {
    const int64_t at_ns = rises_ns_[risen_ % kMostBuffers].load(std::memory_order_relaxed);
    if (at_ns < sees_trigger_ns_) continue;
    sees_trigger_ns_ = at_ns + settings_.rate.period_ns() * 9 / 10;
    expose_next(at_ns);
  }
}

void VideoDouble::begin_stream(int64_t since_ns) {
  stream_ns_ = since_ns;
  const int64_t trigger_ns = trigger_ns_.load();
  origin_ns_ = trigger_ns == INT64_MIN ? since_ns : trigger_ns;
  first_ = next_ = settings_.trigger_line.empty() ? settings_.rate.releases_before(origin_ns_, since_ns) : 0;
  sees_trigger_ns_ = since_ns;
}

void VideoDouble::expose_next(int64_t at_ns) {
  const auto k = static_cast<uint32_t>(next_++ - first_);
  if (how() == Misbehaviour::silent) return;
  for (Buffer& buffer : buffers_) {
    State queued = State::queued;
    if (!buffer.state.compare_exchange_strong(queued, State::exposes)) continue;
    expose(buffer, k, at_ns);
    return;
  }
}

void VideoDouble::expose(Buffer& buffer, uint32_t k, int64_t at_ns) {
  if (how() != Misbehaviour::repeated) {
    last_k_ = k;
    last_stamp_ns_ = at_ns;
  }
  if (how() != Misbehaviour::frozen) {
    picture_ = last_k_;
    picture_ns_ = last_stamp_ns_;
  }
  fill_(picture_, picture_ns_, buffer.bytes);
  buffer.sequence = how() == Misbehaviour::uncounted ? 0 : last_k_;
  buffer.stamp_ns = last_stamp_ns_;
  buffer.flags = how() == Misbehaviour::unstamped ? V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (how() == Misbehaviour::flagged || how() == Misbehaviour::garbage) buffer.flags |= V4L2_BUF_FLAG_ERROR;
  if (how() == Misbehaviour::garbage) {
    for (size_t i = 0; i < buffer.bytes.size(); ++i) buffer.bytes[i] ^= static_cast<uint8_t>(i * 167 + k);
  }
  buffer.bytes_used = how() == Misbehaviour::empty ? 0
                      : how() == Misbehaviour::cut ? settings_.frame_bytes / 2
                                                   : settings_.frame_bytes;
  const bool streams = streaming_since_ns_.load() == stream_ns_;
  buffer.state.store(streams ? State::done : State::idle);
  if (streams) eventfd_write(wakes_, 1);
}

}  // namespace takt::v4l2
