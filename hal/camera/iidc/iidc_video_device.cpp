// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/iidc/iidc_video_device.hpp"

#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>

#include "hal/camera/frame_codec.hpp"

namespace takt::iidc {
namespace {

int to_errno(dc1394error_t error) {
  switch (error) {
    case DC1394_SUCCESS: return 0;
    case DC1394_NOT_A_CAMERA:
    case DC1394_CAMERA_NOT_INITIALIZED:
    case DC1394_CAPTURE_IS_NOT_SET: return ENODEV;
    case DC1394_MEMORY_ALLOCATION_FAILURE: return ENOMEM;
    case DC1394_NO_ISO_CHANNEL:
    case DC1394_NO_BANDWIDTH: return ENOSPC;
    case DC1394_CAPTURE_IS_RUNNING: return EBUSY;
    case DC1394_FAILURE:
    case DC1394_IOCTL_FAILURE: return EIO;
    default: return EINVAL;
  }
}

/// 0: it has no name in V4L2 that the driver reads.
uint32_t code_of(dc1394color_coding_t coding) {
  if (coding == DC1394_COLOR_CODING_RAW16 || coding == DC1394_COLOR_CODING_MONO16)
    return four_characters(v4l2::FrameFormat::y16);
  return coding == DC1394_COLOR_CODING_RGB8 ? four_characters(v4l2::FrameFormat::rgb3) : 0;
}

int64_t real_time_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

IidcVideoDevice::IidcVideoDevice(const IidcSettings& settings, const Dc1394Calls* calls, const Clock& clock,
                                 RealTime real_time)
    : settings_(settings),
      calls_(calls),
      clock_(clock),
      real_time_(real_time ? std::move(real_time) : RealTime(real_time_ns)) {}

int IidcVideoDevice::open(const std::string&) {
  close();
  if (calls_ == nullptr) return ELIBACC;
  library_ = calls_->dc1394_new();
  const int error = library_ == nullptr ? ENODEV : find_camera();
  const int refused = error == 0 ? prepare() : error;
  if (refused != 0) close();
  return refused;
}

int IidcVideoDevice::find_camera() {
  uint64_t guid = settings_.guid;
  if (guid == 0) {
    dc1394camera_list_t* list = nullptr;
    if (const int error = to_errno(calls_->dc1394_camera_enumerate(library_, &list)); error != 0) return error;
    const uint32_t count = list->num;
    if (count == 1) guid = list->ids[0].guid;
    calls_->dc1394_camera_free_list(list);
    if (count != 1) return count == 0 ? ENODEV : ENOTUNIQ;
  }
  camera_ = calls_->dc1394_camera_new(library_, guid);
  return camera_ == nullptr ? ENODEV : 0;
}

int IidcVideoDevice::prepare() {
  calls_->dc1394_camera_set_power(camera_, DC1394_ON);         // many have no such register
  calls_->dc1394_video_set_transmission(camera_, DC1394_OFF);  // of a program that was killed
  dc1394speed_t speed = DC1394_ISO_SPEED_400;
  if (camera_->bmode_capable != 0 &&
      calls_->dc1394_video_set_operation_mode(camera_, DC1394_OPERATION_MODE_1394B) == DC1394_SUCCESS)
    speed = DC1394_ISO_SPEED_800;
  if (const int error = to_errno(calls_->dc1394_video_set_iso_speed(camera_, speed)); error != 0) return error;
  if (settings_.eyes) {
    const auto pan = static_cast<uint32_t>(*settings_.eyes);
    if (const int error = to_errno(calls_->dc1394_feature_set_value(camera_, DC1394_FEATURE_PAN, pan)); error != 0)
      return error;
  }
  return set_trigger();
}

int IidcVideoDevice::set_trigger() {
  if (!settings_.triggered) {
    calls_->dc1394_external_trigger_set_power(camera_, DC1394_OFF);  // a camera without one runs at its rate
    return 0;
  }
  const auto polarity = settings_.falling ? DC1394_TRIGGER_ACTIVE_LOW : DC1394_TRIGGER_ACTIVE_HIGH;
  for (const dc1394error_t done : {calls_->dc1394_external_trigger_set_mode(camera_, DC1394_TRIGGER_MODE_0),
                                   calls_->dc1394_external_trigger_set_source(camera_, DC1394_TRIGGER_SOURCE_0),
                                   calls_->dc1394_external_trigger_set_polarity(camera_, polarity),
                                   calls_->dc1394_external_trigger_set_power(camera_, DC1394_ON)})
    if (const int error = to_errno(done); error != 0) return error;
  return 0;
}

void IidcVideoDevice::close() {
  end();
  if (camera_ != nullptr) calls_->dc1394_camera_free(camera_);
  if (library_ != nullptr) calls_->dc1394_free(library_);
  camera_ = nullptr, library_ = nullptr;
}

int IidcVideoDevice::control(unsigned long request, void* argument) {
  if (camera_ == nullptr) return ENODEV;
  switch (request) {
    case VIDIOC_QUERYCAP:
      static_cast<v4l2_capability*>(argument)->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    case VIDIOC_ENUM_FMT: return offer(argument);
    case VIDIOC_S_FMT: return set_format(argument);
    case VIDIOC_S_PARM: return set_rate(argument);
    case VIDIOC_S_CTRL: return set_control(argument);
    case VIDIOC_REQBUFS: return allocate(argument);
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= buffer_count_) return EINVAL;
      buffer.length = static_cast<uint32_t>(frame_bytes_);
      buffer.m.offset = buffer.index;
      return 0;
    }
    case VIDIOC_QBUF: {
      const auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= buffer_count_) return EINVAL;
      buffers_[buffer.index].queued = true;
      return 0;
    }
    case VIDIOC_DQBUF: return take(argument);
    case VIDIOC_STREAMON: return begin();
    case VIDIOC_STREAMOFF: end(); return 0;
    default: return ENOTTY;
  }
}

std::vector<dc1394color_coding_t> IidcVideoDevice::codings() const {
  dc1394color_codings_t all{};
  if (calls_->dc1394_format7_get_color_codings(camera_, kMode, &all) != DC1394_SUCCESS) return {};
  const uint32_t count = std::min<uint32_t>(all.num, DC1394_COLOR_CODING_NUM);
  return {all.codings, all.codings + count};
}

int IidcVideoDevice::offer(void* argument) {
  auto& told = *static_cast<v4l2_fmtdesc*>(argument);
  std::vector<uint32_t> codes;
  for (const dc1394color_coding_t coding : codings())
    if (const uint32_t code = code_of(coding); code != 0 && std::find(codes.begin(), codes.end(), code) == codes.end())
      codes.push_back(code);
  if (told.index >= codes.size()) return EINVAL;
  told.pixelformat = codes[told.index];
  return 0;
}

int IidcVideoDevice::set_format(void* argument) {
  v4l2_pix_format& pixels = static_cast<v4l2_format*>(argument)->fmt.pix;
  const auto all = codings();
  const auto coding = std::find_if(all.begin(), all.end(), [&](auto c) { return code_of(c) == pixels.pixelformat; });
  if (coding == all.end()) return EINVAL;
  uint32_t widest = 0, highest = 0;
  if (const int error = to_errno(calls_->dc1394_format7_get_max_image_size(camera_, kMode, &widest, &highest));
      error != 0)
    return error;
  // A part of the sensors would be another camera than the rig's.
  if (pixels.width != widest || pixels.height != highest) {
    pixels.width = widest, pixels.height = highest;
    return 0;
  }
  width_ = widest, height_ = highest;
  bytes_per_pixel_ = *coding == DC1394_COLOR_CODING_RGB8 ? 3 : 2;
  if (const int error = to_errno(calls_->dc1394_video_set_mode(camera_, kMode)); error != 0) return error;
  const auto roi = calls_->dc1394_format7_set_roi(camera_, kMode, *coding, DC1394_USE_MAX_AVAIL, 0, 0,
                                                  static_cast<int32_t>(width_), static_cast<int32_t>(height_));
  pixels.bytesperline = width_ * bytes_per_pixel_;
  return to_errno(roi);
}

/// The fewest bytes a packet that give the rate: what is left of the bus others have.
int IidcVideoDevice::set_rate(void* argument) {
  v4l2_fract& period = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
  uint32_t unit = 0, most = 0;
  if (const int error = to_errno(calls_->dc1394_format7_get_packet_parameters(camera_, kMode, &unit, &most));
      error != 0)
    return error;
  if (unit == 0 || most < unit || period.denominator == 0) return EINVAL;
  const double asked_s = 1.0 * period.numerator / period.denominator;
  const uint64_t image = uint64_t{width_} * height_ * bytes_per_pixel_;
  const auto at_most = std::max<uint64_t>(1, static_cast<uint64_t>(asked_s / kPacket_s));
  const uint64_t needed = (image + at_most - 1) / at_most;
  const auto bytes = static_cast<uint32_t>(std::min<uint64_t>((needed + unit - 1) / unit * unit, most / unit * unit));
  if (const int error = to_errno(calls_->dc1394_format7_set_packet_size(camera_, kMode, bytes)); error != 0)
    return error;
  packets_ = static_cast<uint32_t>((image + bytes - 1) / bytes);
  period = {packets_ * 125, 1'000'000};
  return to_errno(calls_->dc1394_format7_get_total_bytes(camera_, kMode, &frame_bytes_));
}

int IidcVideoDevice::set_control(void* argument) {
  const auto& wanted = *static_cast<v4l2_control*>(argument);
  switch (wanted.id) {
    case V4L2_CID_EXPOSURE_AUTO:
      return to_errno(calls_->dc1394_feature_set_mode(camera_, DC1394_FEATURE_SHUTTER, DC1394_FEATURE_MODE_MANUAL));
    case V4L2_CID_EXPOSURE_ABSOLUTE: return set_shutter(wanted.value * 1e-4);
    case V4L2_CID_GAIN:
      calls_->dc1394_feature_set_mode(camera_, DC1394_FEATURE_GAIN, DC1394_FEATURE_MODE_MANUAL);
      return to_errno(
          calls_->dc1394_feature_set_value(camera_, DC1394_FEATURE_GAIN, static_cast<uint32_t>(wanted.value)));
    default: return EINVAL;
  }
}

int IidcVideoDevice::set_shutter(double s) {
  if (const int error =
          to_errno(calls_->dc1394_feature_set_absolute_control(camera_, DC1394_FEATURE_SHUTTER, DC1394_ON));
      error != 0)
    return error;
  return to_errno(calls_->dc1394_feature_set_absolute_value(camera_, DC1394_FEATURE_SHUTTER, static_cast<float>(s)));
}

int IidcVideoDevice::allocate(void* argument) {
  auto& request = *static_cast<v4l2_requestbuffers*>(argument);
  if (frame_bytes_ == 0) return EINVAL;  // the camera refused a rate
  request.count = std::min(request.count, kMostBuffers);
  for (uint32_t i = 0; i < request.count; ++i) buffers_[i] = {std::vector<uint8_t>(frame_bytes_), false};
  buffer_count_ = request.count;
  return 0;
}

std::span<const uint8_t> IidcVideoDevice::map(size_t bytes, uint32_t index) {
  if (index >= buffer_count_ || bytes != buffers_[index].bytes.size()) return {};
  return buffers_[index].bytes;
}

int IidcVideoDevice::begin() {
  if (streaming_) return 0;
  if (const int error = to_errno(calls_->dc1394_capture_setup(camera_, kRing, DC1394_CAPTURE_FLAGS_DEFAULT));
      error != 0)
    return error;
  streaming_ = true;
  last_us_.reset();
  number_ = 0;
  const int error = to_errno(calls_->dc1394_video_set_transmission(camera_, DC1394_ON));
  if (error != 0) end();
  return error;
}

void IidcVideoDevice::end() {
  for (Buffer& buffer : buffers_) buffer.queued = false;
  if (!streaming_) return;
  calls_->dc1394_video_set_transmission(camera_, DC1394_OFF);
  calls_->dc1394_capture_stop(camera_);
  streaming_ = false;
}

int IidcVideoDevice::take(void* argument) {
  const auto free =
      std::find_if(buffers_.begin(), buffers_.begin() + buffer_count_, [](const Buffer& b) { return b.queued; });
  if (!streaming_) return EINVAL;
  if (free == buffers_.begin() + buffer_count_) return EAGAIN;  // it stays in the ring
  dc1394video_frame_t* frame = nullptr;
  if (const int error = to_errno(calls_->dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, &frame));
      error != 0)
    return error;
  if (frame == nullptr) return EAGAIN;
  auto& told = *static_cast<v4l2_buffer*>(argument);
  const size_t bytes = std::min<size_t>(frame->image_bytes, free->bytes.size());
  std::memcpy(free->bytes.data(), frame->image, bytes);
  free->queued = false;
  told.index = static_cast<uint32_t>(free - buffers_.begin());
  told.bytesused = static_cast<uint32_t>(bytes);
  told.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (calls_->dc1394_capture_is_frame_corrupt(camera_, frame) == DC1394_TRUE) told.flags |= V4L2_BUF_FLAG_ERROR;
  told.sequence = number_of(frame->timestamp);
  const auto since_ns = real_time_() - static_cast<int64_t>(frame->timestamp) * 1000;
  const int64_t stamp_us = (clock_.now_ns() - since_ns) / 1000 - int64_t{packets_} * 125;
  told.timestamp = {stamp_us / 1'000'000, stamp_us % 1'000'000};
  return to_errno(calls_->dc1394_capture_enqueue(camera_, frame));
}

uint32_t IidcVideoDevice::number_of(uint64_t stamp_us) {
  if (last_us_) {
    const double periods = (static_cast<double>(stamp_us) - static_cast<double>(*last_us_)) / (packets_ * 125.0);
    number_ += static_cast<uint32_t>(std::clamp(std::llround(periods), 1LL, 1'000'000LL));
  }
  last_us_ = stamp_us;
  return number_;
}

short IidcVideoDevice::wait(int64_t timeout_ns) {
  if (!streaming_) return POLLERR;
  pollfd poll{calls_->dc1394_capture_get_fileno(camera_), POLLIN, 0};
  const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
  return ppoll(&poll, 1, &timeout, nullptr) > 0 ? poll.revents : static_cast<short>(0);
}

}  // namespace takt::iidc
