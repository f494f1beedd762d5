// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/replay_camera.hpp"

#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "hal/replay/recording_layout.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/msg/image.hpp"

namespace takt::replay {
namespace {

constexpr size_t kDecodeAtOpen = 200;  ///< files of longer, larger recordings are checked by header and end only

void copy(const cv::Mat& from, ImageView<uint8_t> to) {
  const size_t row = static_cast<size_t>(to.width) * static_cast<size_t>(to.channels);
  for (int y = 0; y < to.height; ++y) std::memcpy(to.row(y), from.ptr(y), row);
}

/// Throws ImageError.
cv::Mat decode(const std::filesystem::path& file, int channels, const ReplayCameraSettings& settings) {
  const int shrink = settings.shrink;
  cv::Mat image = read_image(file,
                             channels == 1   ? Channels::grey
                             : channels == 3 ? Channels::colour
                                             : Channels::as_file,
                             settings.bits);
  if (shrink == 1 || image.cols < shrink || image.rows < shrink) return image;
  cv::Mat small;
  // Whole blocks only, so that a pixel of the small image is the mean of shrink x shrink pixels.
  const cv::Rect whole(0, 0, image.cols / shrink * shrink, image.rows / shrink * shrink);
  cv::resize(image(whole), small, whole.size() / shrink, 0, 0, cv::INTER_AREA);
  return small;
}

/// Focal length and principal point after shrinking: pixel centres lie at whole numbers.
CameraModel shrunk(CameraModel camera, int by) {
  const double factor = by;
  camera.focal_px /= factor;
  camera.cu_px = (camera.cu_px + 0.5) / factor - 0.5;
  camera.cv_px = (camera.cv_px + 0.5) / factor - 0.5;
  return camera;
}

}  // namespace

struct ReplayCamera::Store {
  std::vector<cv::Mat> left, right;  ///< decoded frames; empty Mats where the file is decoded on reading
};

ReplayCamera::ReplayCamera(std::string id, ReplayCameraSettings settings, const Clock& clock)
    : id_(std::move(id)), settings_(std::move(settings)), clock_(clock) {}
ReplayCamera::~ReplayCamera() = default;

DeviceResult ReplayCamera::open() {
  if (store_) return {};
  if (auto found = find_files(); !found) return found;
  if (auto decoded = decode_all(); !decoded) {
    store_.reset();
    return decoded;
  }
  frames_ = settings_.directory.empty() ? settings_.frames : static_cast<int64_t>(files_.left.size());
  return {};
}

void ReplayCamera::close() {
  started_ = false;
  store_.reset();
}

DeviceResult ReplayCamera::find_files() {
  if (const auto pair = middlebury_pair(settings_.directory);
      pair && !std::filesystem::exists(settings_.directory / "image_l")) {
    settings_.left = pair->first;
    settings_.right = pair->second;
    std::vector<std::string> left_out;
    if (const auto camera = middlebury_camera(settings_.directory / "calib.txt", left_out);
        camera && settings_.camera.focal_px == 0) {
      settings_.camera = *camera;
      files_.left_out = std::move(left_out);
    }
    settings_.directory.clear();
  }
  if (!settings_.directory.empty()) {
    auto files = list_directory(id_, settings_.directory);
    if (!files) return tl::unexpected(files.error());
    files_ = std::move(*files);
    return {};
  }
  if (settings_.left.empty() || settings_.right.empty()) {
    return device_error(id_, "neither `directory` nor `left` and `right` are given",
                        "add `directory: PATH`, or `left: FILE, right: FILE, focal: N, baseline: 0.1m`");
  }
  if (settings_.camera.focal_px <= 0 || settings_.camera.baseline_m <= 0) {
    return device_error(id_, "`focal` (px) and `baseline` (m) of the pair must be positive",
                        "give both; they belong to the calibration of the images");
  }
  files_ = StereoFiles{{settings_.left}, {settings_.right}, {}, settings_.camera, true, std::move(files_.left_out)};
  return {};
}

DeviceResult ReplayCamera::decode_all() {
  for (const auto* side : {&files_.left, &files_.right}) {
    for (const auto& file : *side) {
      if (const auto complete = check_complete(file); !complete) {
        return device_error(id_, file.string() + ": " + complete.error(), "record or copy the file again");
      }
    }
  }
  store_ = std::make_unique<Store>();
  const size_t count = files_.left.size();
  store_->left.resize(count);
  store_->right.resize(count);
  uint64_t bytes = 0;
  cv::Size size;
  int channels = settings_.channels;
  for (size_t i = 0; i < count; ++i) {
    const bool room = bytes < settings_.memory_limit;
    if (!room && i >= kDecodeAtOpen) break;
    cv::Mat pair[2];
    for (int side = 0; side < 2; ++side) {
      const auto& file = side == 0 ? files_.left[i] : files_.right[i];
      try {
        pair[side] = decode(file, channels, settings_);
      } catch (const ImageError& problem) {
        return device_error(id_, problem.what(), "correct the setting or the file, or record it again");
      }
      if (i == 0 && side == 0) {
        size = pair[0].size();
        channels = pair[0].channels();
      }
      if (pair[side].size() != size) {
        return device_error(id_,
                            file.string() + ": is " + std::to_string(pair[side].cols) + " x " +
                                std::to_string(pair[side].rows) + ", the first image is " + std::to_string(size.width) +
                                " x " + std::to_string(size.height),
                            "all images of a recording need one size");
      }
      bytes += pair[side].total() * pair[side].elemSize();
    }
    if (bytes <= settings_.memory_limit) {
      store_->left[i] = pair[0];
      store_->right[i] = pair[1];
    }
  }
  const bool centre_given = files_.camera.cu_px != 0 || files_.camera.cv_px != 0;
  format_ = {size.width,          size.height, channels, files_.rectified, shrunk(files_.camera, settings_.shrink),
             settings_.rate.hz(), {}};
  // A single pair names the centre of its image unless told otherwise.
  if (!files_.rectified) {
    format_.camera = {};
  } else if (!centre_given) {
    format_.camera.cu_px = (size.width - 1) / 2.0;
    format_.camera.cv_px = (size.height - 1) / 2.0;
  }
  return {};
}

DeviceResult ReplayCamera::start(int64_t epoch_ns) {
  if (!store_) return device_error(id_, "start before open", "call open() first");
  epoch_ns_ = epoch_ns;
  next_ = 0;
  has_trigger_ = ever_triggered_ = false;
  started_ = true;
  return {};
}

int64_t ReplayCamera::stamp_of(int64_t frame) const {
  if (!files_.stamp_ns.empty()) return epoch_ns_ + files_.stamp_ns[static_cast<size_t>(frame)];
  return settings_.rate.release_ns(epoch_ns_, frame);
}

StampLaw ReplayCamera::stamp_law(const JobTimes& jobs) const {
  if (!jobs.rate) return StampLaw::none("its jobs have no rate, and each delivers one recorded frame");
  StampLaw law;
  for (int64_t frame = 0; frame < frames_; ++frame) {
    const int64_t released_ns = jobs.rate->release_ns(epoch_ns_ + jobs.offset_ns, frame);
    law.latency_ns = std::max(law.latency_ns, released_ns - stamp_of(frame));
  }
  return law;
}

void ReplayCamera::trigger(int64_t at_ns) {
  triggered_ns_ = at_ns;
  has_trigger_ = ever_triggered_ = true;
}

DeclaredCalls ReplayCamera::declared_calls() const {
  if (!store_ || store_->left.empty() || !store_->left.back().empty()) return {};
  return {bit(JobCall::malloc) | bit(JobCall::mmap) | bit(JobCall::file) | bit(JobCall::stdio),
          "the recording is larger than what is held in memory: its frames are decoded as they are read"};
}

StereoFrame ReplayCamera::read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) {
  StereoFrame frame;
  if (!started_) return frame;
  if (next_ >= frames_) {
    frame.status = ReadStatus::end_of_data;
    return frame;
  }
  if (has_trigger_ ? triggered_ns_ > deadline_ns : (ever_triggered_ || stamp_of(next_) > clock_.now_ns())) return frame;
  has_trigger_ = false;
  const size_t index = settings_.directory.empty() ? 0 : static_cast<size_t>(next_);
  cv::Mat decoded[2] = {store_->left[index], store_->right[index]};
  if (decoded[0].empty()) {
    // Larger than memory_limit: the price is a file read and an allocation in the job, as the settings allow.
    try {
      decoded[0] = decode(files_.left[index], format_.channels, settings_);
      decoded[1] = decode(files_.right[index], format_.channels, settings_);
    } catch (const ImageError&) {
      decoded[0] = cv::Mat();  // the frame is partial
    }
  }
  frame.frame_number = static_cast<uint32_t>(next_);
  frame.stamp_ns = stamp_of(next_++);
  const cv::Size size(format_.width, format_.height);
  const bool whole = decoded[0].size() == size && decoded[1].size() == size &&
                     decoded[0].channels() == format_.channels && decoded[1].channels() == format_.channels;
  if (whole) {
    copy(decoded[0], left);
    copy(decoded[1], right);
  }
  frame.status = whole ? ReadStatus::ok : ReadStatus::partial;
  frame.health = whole ? 0 : image_health::partial;
  return frame;
}

}  // namespace takt::replay
