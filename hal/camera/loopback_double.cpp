// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/loopback_double.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace takt::v4l2 {
namespace {

constexpr std::array kKnown{Misbehaviour::none, Misbehaviour::silent, Misbehaviour::unplugged, Misbehaviour::frozen,
                            Misbehaviour::cut};

}  // namespace

LoopbackDouble::LoopbackDouble(Settings settings, VideoDouble::Fill fill)
    : settings_(std::move(settings)), fill_(std::move(fill)) {
  FrameLayout& layout = settings_.layout;
  layout.bytes_per_line = layout.row_bytes();
  frame_.resize(layout.image_bytes());
}

LoopbackDouble::~LoopbackDouble() { leave(); }

DeviceResult LoopbackDouble::plug_in() {
  if (descriptor_ >= 0) return {};
  const auto refused = [this](const char* what) {
    const int error = errno;
    leave();
    return device_failure(settings_.path, std::string(what) + ": " + std::strerror(error),
                          "name a device of v4l2loopback that nobody writes to; `modprobe v4l2loopback` makes one");
  };
  descriptor_ = ::open(settings_.path.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor_ < 0) return refused("cannot be opened");
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = static_cast<uint32_t>(settings_.layout.frame_width());
  format.fmt.pix.height = static_cast<uint32_t>(settings_.layout.height);
  format.fmt.pix.pixelformat = four_characters(settings_.layout.format);
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.colorspace = V4L2_COLORSPACE_SRGB;
  if (ioctl(descriptor_, VIDIOC_S_FMT, &format) != 0) return refused("takes no frames of that format");
  // Frames are written, not queued; but the module notices only of who streams that it leaves, and takes nobody else.
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  if (ioctl(descriptor_, VIDIOC_STREAMON, &type) != 0) return refused("takes no frames");
  return {};
}

void LoopbackDouble::leave() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

void LoopbackDouble::run_to(int64_t now_ns) {
  if (next_ == 0) origin_ns_ = now_ns;
  if (settings_.rate.release_ns(origin_ns_, next_) > now_ns) return;
  const int64_t due = settings_.rate.releases_before(origin_ns_, now_ns + 1) - 1;
  next_ = due + 1;
  if (how_ == Misbehaviour::silent || how_ == Misbehaviour::unplugged || !plug_in()) return;
  if (how_ != Misbehaviour::frozen)
    fill_(static_cast<uint32_t>(due), settings_.rate.release_ns(origin_ns_, due), frame_);
  const size_t size = how_ == Misbehaviour::cut ? frame_.size() / 2 : frame_.size();
  if (::write(descriptor_, frame_.data(), size) < 0) leave();  // and tries again with the next frame
}

std::span<const Misbehaviour> LoopbackDouble::known() const { return kKnown; }

void LoopbackDouble::misbehave(Misbehaviour how) {
  how_ = how;
  if (how == Misbehaviour::unplugged) leave();
}

}  // namespace takt::v4l2
