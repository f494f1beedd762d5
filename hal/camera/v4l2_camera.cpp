// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/v4l2_camera.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "rt/msg/image.hpp"

namespace takt::v4l2 {
namespace {

constexpr uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr int64_t kLongestWait_ns = 1'000'000'000;
constexpr int64_t kSilence_ns = 1'000'000'000;
/// A frame that comes later than so long before the deadline could not be moved into the message in time.
constexpr int64_t kMoving_ns = 4'000'000;

v4l2_buffer buffer_of(uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = kCapture;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

int64_t to_ns(const timeval& t) { return (int64_t{t.tv_sec} * 1'000'000 + t.tv_usec) * 1000; }

}  // namespace

V4l2Camera::V4l2Camera(std::string id, V4l2CameraSettings settings, std::unique_ptr<VideoDevice> device,
                       const Clock& clock, std::unique_ptr<FrameTrigger> trigger)
    : id_(std::move(id)),
      settings_(std::move(settings)),
      device_(std::move(device)),
      trigger_(std::move(trigger)),
      clock_(clock) {
  settings_.layout.width = settings_.rig.width;
  settings_.layout.height = settings_.rig.height;
  rate_hz_ = settings_.rate.hz();
}

DeviceResult V4l2Camera::check_settings() const {
  const FrameLayout& layout = settings_.layout;
  if (layout.left == layout.right || std::min(layout.left, layout.right) < 0 ||
      std::max(layout.left, layout.right) >= layout.planes()) {
    return device_error(id_, "`left` and `right` name no two different eyes of the format",
                        "use two of 0.." + std::to_string(layout.planes() - 1));
  }
  if (layout.format == FrameFormat::yuyv && (layout.mosaic != Mosaic::none || layout.width % 2 != 0))
    return device_error(id_, "yuyv has colours of its own, for pairs of pixels",
                        "leave `bayer` out, use an even width");
  return {};
}

DeviceResult V4l2Camera::open() {
  if (open_) return {};
  if (const auto sound = check_settings(); !sound) return sound;
  const FrameLayout& layout = settings_.layout;
  if (const Trouble trouble = claim()) {
    DeviceResult result = told(trouble);
    release();
    return result;
  }
  if (layout.mosaic != Mosaic::none) {
    left_mosaic_.resize(static_cast<size_t>(layout.width) * static_cast<size_t>(layout.height));
    right_mosaic_.resize(left_mosaic_.size());
  }
  open_ = true;
  return {};
}

V4l2Camera::Trouble V4l2Camera::claim() {
  if (const int error = trigger_ ? trigger_->open() : 0; error != 0)
    return {"cannot be had", error, Trouble::Of::trigger};
  if (const int error = device_->open(settings_.path); error != 0) return {"cannot be opened", error};
  v4l2_capability capability{};
  if (const int error = device_->control(VIDIOC_QUERYCAP, &capability); error != 0)
    return {"is no video device", error};
  const uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) return {"captures nothing", 0};
  if ((can & V4L2_CAP_STREAMING) == 0) return {"cannot stream into shared buffers", 0};
  if (const Trouble trouble = negotiate()) return trouble;
  if (settings_.exposure_s > 0) {
    // Refused by devices without an automatic exposure: what counts is the next one.
    set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "");
    const auto steps = static_cast<int32_t>(std::lround(settings_.exposure_s * 1e4));  // of 100 us
    if (const Trouble trouble = set_control(V4L2_CID_EXPOSURE_ABSOLUTE, steps, "refuses `exposure`")) return trouble;
  }
  if (settings_.gain >= 0) {
    const auto steps = static_cast<int32_t>(std::lround(settings_.gain));
    if (const Trouble trouble = set_control(V4L2_CID_GAIN, steps, "refuses `gain`")) return trouble;
  }
  return map_buffers();
}

V4l2Camera::Trouble V4l2Camera::negotiate() {
  FrameLayout& layout = settings_.layout;
  v4l2_format format{};
  format.type = kCapture;
  format.fmt.pix.width = static_cast<uint32_t>(layout.frame_width());
  format.fmt.pix.height = static_cast<uint32_t>(layout.height);
  format.fmt.pix.pixelformat = four_characters(layout.format);
  format.fmt.pix.field = V4L2_FIELD_NONE;
  const v4l2_pix_format asked = format.fmt.pix;
  if (const int error = device_->control(VIDIOC_S_FMT, &format); error != 0) return {"refuses its format", error};
  const v4l2_pix_format& got = format.fmt.pix;
  if (got.pixelformat != asked.pixelformat) return {"does not have the format", 0};
  if (got.width != asked.width || got.height != asked.height) return {"does not have the size of the rig", 0};
  layout.bytes_per_line = std::max<size_t>(got.bytesperline, layout.row_bytes());
  v4l2_streamparm rate{};
  rate.type = kCapture;
  rate.parm.capture.timeperframe = {static_cast<uint32_t>(settings_.rate.denominator),
                                    static_cast<uint32_t>(settings_.rate.numerator)};
  rate_hz_ = settings_.rate.hz();
  // Not every device has a rate to set; what it says is what it does.
  if (device_->control(VIDIOC_S_PARM, &rate) != 0) return {};
  const v4l2_fract period = rate.parm.capture.timeperframe;
  if (period.numerator > 0 && period.denominator > 0) rate_hz_ = 1.0 * period.denominator / period.numerator;
  return {};
}

V4l2Camera::Trouble V4l2Camera::set_control(uint32_t control, int32_t value, const char* what) {
  v4l2_control wanted{control, value};
  const int error = device_->control(VIDIOC_S_CTRL, &wanted);
  return error == 0 ? Trouble{} : Trouble{what, error};
}

V4l2Camera::Trouble V4l2Camera::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = settings_.buffers;
  request.type = kCapture;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = device_->control(VIDIOC_REQBUFS, &request); error != 0) return {"gives no buffers", error};
  if (request.count < 2) return {"gives fewer than two buffers", 0};
  if (settings_.dmabuf && request.count < 3) return {"gives fewer than three buffers, one of which is to be lent", 0};
  for (uint32_t i = 0; i < std::min(request.count, kMostBuffers); ++i) {
    v4l2_buffer buffer = buffer_of(i);
    if (const int error = device_->control(VIDIOC_QUERYBUF, &buffer); error != 0) return {"hides a buffer", error};
    buffers_[i] = device_->map(buffer.length, buffer.m.offset);
    if (buffers_[i].empty()) return {"has a buffer that cannot be mapped", errno};
    buffer_count_ = i + 1;
    if (const Trouble trouble = export_buffer(i)) return trouble;
  }
  return {};
}

V4l2Camera::Trouble V4l2Camera::export_buffer(uint32_t index) {
  if (!settings_.dmabuf) return {};
  v4l2_exportbuffer request{};
  request.type = kCapture;
  request.index = index;
  request.flags = O_RDONLY | O_CLOEXEC;
  if (const int error = device_->control(VIDIOC_EXPBUF, &request); error != 0)
    return {"exports no buffer", error, Trouble::Of::export_};
  exported_[index] = Descriptor(request.fd);
  return {};
}

void V4l2Camera::release() {
  for (uint32_t i = 0; i < buffer_count_; ++i) {
    device_->unmap(buffers_[i]);
    exported_[i].close();
  }
  buffer_count_ = 0;
  device_->close();
  if (trigger_) trigger_->close();
}

void V4l2Camera::close() {
  stop();
  if (open_) release();
  open_ = false;
}

std::string V4l2Camera::offered_formats() {
  std::string all;
  v4l2_fmtdesc format{};
  format.type = kCapture;
  for (; format.index < 64 && device_->control(VIDIOC_ENUM_FMT, &format) == 0; ++format.index)
    all.append(all.empty() ? "" : ", ").append(four_characters_text(format.pixelformat));
  return all.empty() ? "none" : all;
}

DeviceResult V4l2Camera::told(const Trouble& trouble) {
  if (trouble.of == Trouble::Of::trigger) {
    const FrameTriggerSettings& line = trigger_->settings();
    return device_failure(
        id_, line.chip + ": trigger line `" + line.line + "` " + trouble.what + ": " + std::strerror(trouble.error),
        trouble.error == EBUSY ? "end the program that holds it: gpioinfo names it"
                               : "name a chip and a line of this machine: gpioinfo");
  }
  const std::string what = settings_.path + ": " + trouble.what + (trouble.error != 0 ? ": " : "") +
                           (trouble.error != 0 ? std::strerror(trouble.error) : "");
  if (trouble.of == Trouble::Of::export_)
    return device_failure(id_, what, "the device's driver does not offer it: leave `dmabuf` out");
  switch (trouble.error) {
    case ENOENT:
    case ENODEV:
    case ENXIO: return device_failure(id_, what, "plug the camera in, or name another: takt devices");
    case EBUSY: return device_failure(id_, what, "end the program that holds it: fuser " + settings_.path);
    case EACCES: return device_failure(id_, what, "join the group video, or run as root");
    case ELIBACC: return device_failure(id_, what, "install the library of FireWire cameras: apt install libdc1394-25");
    case ENOTUNIQ: return device_failure(id_, what, "say with `guid` which of the cameras it is: takt devices");
    case ENOSPC: return device_failure(id_, what, "the bus is full: a lower rate, or another bus for other cameras");
    default: break;
  }
  const FrameLayout& layout = settings_.layout;
  return device_failure(id_, what,
                        "it is asked for " + std::to_string(layout.frame_width()) + " x " +
                            std::to_string(layout.height) + " " + four_characters_text(four_characters(layout.format)) +
                            " (setting `format`, and the rig); it offers: " + offered_formats());
}

DeviceResult V4l2Camera::start(int64_t epoch_ns) {
  if (!open_) return device_error(id_, "start before open", "call open() first");
  epoch_ns_ = epoch_ns;
  const Trouble trouble = stream();
  return trouble ? told(trouble) : DeviceResult{};
}

V4l2Camera::Trouble V4l2Camera::stream() {
  stop();
  if (trigger_) trigger_->start();
  for (uint32_t i = 0; i < buffer_count_; ++i) {
    if (!queue(i)) return {"does not take a buffer", errno};
  }
  uint32_t type = kCapture;
  if (const int error = device_->control(VIDIOC_STREAMON, &type); error != 0) return {"does not stream", error};
  streaming_ = true;
  any_ = counts_itself_ = false;
  io_errors_in_row_ = untriggered_in_row_ = 0;
  lent_ = -1;
  alive_ns_ = clock_.now_ns();
  return {};
}

void V4l2Camera::stop() {
  lost_ = false;
  if (!streaming_) return;
  uint32_t type = kCapture;
  device_->control(VIDIOC_STREAMOFF, &type);
  streaming_ = false;
  lent_ = -1;
}

bool V4l2Camera::restart(int64_t) {
  if (!open_) return false;
  stop();
  release();
  return !claim() && !stream();
}

DeclaredCalls V4l2Camera::declared_calls() const {
  const uint32_t colours = settings_.layout.mosaic == Mosaic::none ? 0 : bit(JobCall::malloc) | bit(JobCall::lock);
  const uint32_t line = trigger_ || device_->allocates() ? bit(JobCall::malloc) : 0;
  return {bit(JobCall::wait) | bit(JobCall::file) | bit(JobCall::mmap) | colours | line,
          "frames are waited for until the deadline, a lost device is opened again (libgpiod and libdc1394 allocate "
          "then); OpenCV makes "
          "the colours"};
}

SourceCounts V4l2Camera::counts() const {
  return {counters_.frames, counters_.damaged + counters_.io_errors, 0, counters_.missing, 0};
}

StereoFormat V4l2Camera::format() const {
  const FrameLayout& layout = settings_.layout;
  return {layout.width,
          layout.height,
          layout.channels(),
          settings_.rig.rectified,
          settings_.rig.camera(),
          trigger_ ? 0 : rate_hz_,
          camera_in_robot(settings_.rig, 0, 0)};
}

StampLaw V4l2Camera::stamp_law(const JobTimes&) const {
  const double period_s = 1 / rate_hz_;
  const double exposure_s = settings_.exposure_s > 0 ? settings_.exposure_s : settings_.longest_exposure_s;
  const auto ns = [&](double s) { return std::llround(1e9 * (s > 0 ? s : period_s)); };
  const int64_t until_here_ns = ns(exposure_s) + ns(settings_.transfer_s);
  if (trigger_) return {0, 0, until_here_ns, {}};
  return {until_here_ns, ns(0), 0, {}};
}

const char* V4l2Camera::trouble() const {
  return untriggered_in_row_ < kIoErrorsToLoss
             ? ""
             : "frames come half a period off every trigger pulse: `stamp_delay`, or the camera's trigger mode";
}

void V4l2Camera::trigger(int64_t at_ns) {
  if (trigger_) trigger_->ask(at_ns);
}

bool V4l2Camera::queue(uint32_t index) {
  v4l2_buffer buffer = buffer_of(index);
  return device_->control(VIDIOC_QBUF, &buffer) == 0;
}

V4l2Camera::Taken V4l2Camera::take_one(Frame& frame) {
  v4l2_buffer buffer = buffer_of(0);
  const int error = device_->control(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return Taken::none;
  if (error == EIO) {  // it may go on
    ++counters_.io_errors;
    return ++io_errors_in_row_ < kIoErrorsToLoss ? Taken::none : Taken::lost;
  }
  if (error != 0 || buffer.index >= buffer_count_) return Taken::lost;
  io_errors_in_row_ = 0;
  const int64_t now_ns = clock_.now_ns();
  const bool stamped = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  counters_.unstamped += stamped ? 0 : 1;
  const int64_t stamp_ns = stamped ? to_ns(buffer.timestamp) - std::llround(settings_.stamp_delay_s * 1e9) : now_ns;
  frame = {buffer.index, std::min<size_t>(buffer.bytesused, buffers_[buffer.index].size()), buffer.sequence,
           std::min(stamp_ns, now_ns), (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0};
  return Taken::frame;
}

V4l2Camera::Taken V4l2Camera::take_newest(Frame& frame) {
  bool held = false;
  // Not for ever: a device may be faster than this loop.
  for (uint32_t k = 0; k < 2 * kMostBuffers; ++k) {
    Frame next;
    const Taken taken = take_one(next);
    if (taken == Taken::lost) return taken;
    if (taken == Taken::none) break;
    if (uint64_t* const counter = left_out(next); counter != nullptr) {
      ++*counter;
      if (!queue(next.index)) return Taken::lost;
      continue;
    }
    count(next);
    if (held) {
      ++counters_.skipped;
      if (!queue(frame.index)) return Taken::lost;
    }
    frame = next;
    held = true;
  }
  return held ? Taken::frame : Taken::none;
}

/// The frame becomes that of the pulse it is of, if it is of one.
bool V4l2Camera::match(Frame& frame) {
  const FrameTrigger::Pulse* pulse = trigger_->of(frame.stamp_ns, settings_.rate.period_ns() / 2);
  untriggered_in_row_ = pulse != nullptr ? 0 : untriggered_in_row_ + 1;
  if (pulse == nullptr) return false;
  frame.sequence = pulse->number;
  frame.stamp_ns = pulse->stamp_ns;
  return true;
}

/// What counts the frame, if it is not to be delivered.
uint64_t* V4l2Camera::left_out(Frame& frame) {
  if (trigger_ && !match(frame)) return &counters_.untriggered;
  if (frame.stamp_ns < epoch_ns_) return &counters_.skipped;
  return repeats(frame) ? &counters_.repeated : nullptr;
}

bool V4l2Camera::repeats(const Frame& frame) const {
  return any_ && frame.sequence == last_.sequence && frame.stamp_ns == last_.stamp_ns;
}

void V4l2Camera::count(const Frame& frame) {
  if (!any_) first_sequence_ = frame.sequence;
  else if (static_cast<int32_t>(frame.sequence - last_.sequence) <= 0) counts_itself_ = true;  // no count, or anew
  else counters_.missing += frame.sequence - last_.sequence - 1;
  last_ = frame;
  any_ = true;
  alive_ns_ = clock_.now_ns();
}

StereoFrame V4l2Camera::read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) {
  if (lost_) return lose();
  if (!streaming_) return {};
  if (trigger_ && trigger_->give() != 0) return lose();
  Frame frame;
  Taken taken = take_newest(frame);
  if (taken == Taken::none || (taken == Taken::frame && awaits_another(frame))) {
    const short events = wait(deadline_ns);
    Frame next;
    const Taken then = take_newest(next);
    if (then == Taken::frame && taken == Taken::frame) {
      ++counters_.skipped;
      if (!queue(frame.index)) return lose();
    }
    if (then == Taken::frame) frame = next;
    if (then != Taken::none) taken = then;
    if (taken == Taken::none && (events & (POLLERR | POLLHUP | POLLNVAL)) != 0) taken = Taken::lost;
  }
  if (taken == Taken::frame) return deliver(frame, left, right);
  const auto three_periods_ns = static_cast<int64_t>(3e9 / rate_hz_);
  if (taken == Taken::lost || clock_.now_ns() - alive_ns_ > std::max(kSilence_ns, three_periods_ns)) return lose();
  return {};
}

/// It is of an earlier pulse than the newest: that read ended too early for it.
bool V4l2Camera::awaits_another(const Frame& frame) const {
  return trigger_ && static_cast<int32_t>(frame.sequence - (trigger_->pulses() - 1)) < 0;
}

/// Until there is a frame, not longer than one of the newest pulse can take; what poll() saw.
short V4l2Camera::wait(int64_t deadline_ns) {
  const int64_t now_ns = clock_.now_ns();
  int64_t until_ns = std::min(deadline_ns - kMoving_ns, now_ns + kLongestWait_ns);
  if (const FrameTrigger::Pulse* pulse = trigger_ ? trigger_->newest() : nullptr)
    until_ns = std::min(until_ns, pulse->stamp_ns + stamp_law({}).wait_ns);
  return until_ns > now_ns ? device_->wait(until_ns - now_ns) : static_cast<short>(0);
}

StereoFrame V4l2Camera::lose() {
  stop();
  lost_ = true;
  StereoFrame frame;
  frame.status = ReadStatus::disconnected;
  return frame;
}

StereoFrame V4l2Camera::deliver(const Frame& frame, ImageView<uint8_t> left, ImageView<uint8_t> right) {
  const FrameLayout& layout = settings_.layout;
  const std::span<const uint8_t> bytes = buffers_[frame.index].first(frame.bytes);
  int rows = 0;
  if (layout.mosaic == Mosaic::none) {
    rows = split(bytes, layout, left, right);
  } else {
    const ImageView<uint8_t> l(left_mosaic_.data(), layout.width, layout.height),
        r(right_mosaic_.data(), layout.width, layout.height);
    rows = split(bytes, layout, l, r);
    debayer(l, layout.mosaic, left);
    debayer(r, layout.mosaic, right);
  }
  StereoFrame result;
  const bool whole = rows == layout.height && !frame.flagged;
  result.status = whole ? ReadStatus::ok : ReadStatus::partial;
  result.health = whole ? 0 : image_health::partial;
  result.stamp_ns = frame.stamp_ns;
  result.frame_number = number_ = counts_itself_ ? number_ + 1 : frame.sequence - first_sequence_;
  counters_.damaged += whole ? 0 : 1;
  ++counters_.frames;
  return give_back(frame.index) ? result : lose();
}

/// The pixels are in the message: the buffer goes back before anybody works on them. One that is lent goes when the
/// next one is.
bool V4l2Camera::give_back(uint32_t index) {
  if (!settings_.dmabuf) return queue(index);
  const int before = std::exchange(lent_, static_cast<int>(index));
  return before < 0 || queue(static_cast<uint32_t>(before));
}

}  // namespace takt::v4l2
