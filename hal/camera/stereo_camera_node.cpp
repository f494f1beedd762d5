// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/stereo_camera_node.hpp"

namespace takt {

StereoCameraNode::StereoCameraNode(std::unique_ptr<StereoCamera> camera, HealthThresholds thresholds)
    : camera_(std::move(camera)), thresholds_(thresholds) {}

void StereoCameraNode::setup(Setup& setup) {
  open_in_setup(setup);
  format_ = camera_->format();
  Capacity capacity;
  capacity.width = static_cast<uint32_t>(format_.width);
  capacity.height = static_cast<uint32_t>(format_.height);
  capacity.channels = static_cast<uint32_t>(format_.channels);
  pair_.reserve(capacity);
  previous_.assign(static_cast<size_t>(health_samples(format_.width, format_.height, thresholds_.step_px)), 0);
  has_previous_ = false;
  rate_ = setup.rate;
  at_its_own_rate_ = stamp_law({setup.rate, setup.offset_ns}).period_ns > 0;
  offset_ns_ = setup.offset_ns;
}

void StereoCameraNode::start(int64_t epoch_ns) {
  DeviceNode::start(epoch_ns);
  if (!rate_) return;
  // Ask for the first exposure before it is due, as each job does for the next one.
  triggered_ns_ = epoch_ns + offset_ns_;
  camera_->trigger(triggered_ns_);
}

int64_t StereoCameraNode::next_release(const Job& job) const {
  // release(k) = floor(origin + k T) with a whole origin, hence origin = release(k) - floor(k T).
  const auto k = static_cast<int64_t>(job.index());
  const int64_t origin = job.release_ns() - rate_->release_ns(0, k);
  return rate_->release_ns(origin, k + 1);
}

void StereoCameraNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  // Usually the job before has asked for this exposure already.
  if (triggered_ns_ != job.release_ns()) camera_->trigger(job.release_ns());
  triggered_ns_ = INT64_MIN;
  StereoPair* message = pair_.loan();
  if (message == nullptr) return job.no_result();
  message->width = format_.width;
  message->height = format_.height;
  message->channels = format_.channels;
  const size_t bytes =
      static_cast<size_t>(format_.width) * static_cast<size_t>(format_.height) * static_cast<size_t>(format_.channels);
  message->left.resize(bytes);
  message->right.resize(bytes);
  // Of a camera at a rate of its own what is there: whoever waits for the next frame sleeps as long as it likes.
  const int64_t until_ns = at_its_own_rate_ ? job.release_ns() : job.deadline_ns();
  const StereoFrame frame = camera_->read(message->left_view(), message->right_view(), until_ns);
  const bool data = frame.status == ReadStatus::ok || frame.status == ReadStatus::partial;
  HealthReading health;
  if (data) health = assess_health(message->left_view(), thresholds_, previous_, has_previous_);
  has_previous_ = has_previous_ || data;
  if (accept(frame.status, job, true, (health.flags & image_health::unchanging) != 0)) {
    message->health = health.flags | frame.health | (frame.status == ReadStatus::partial ? image_health::partial : 0);
    message->frame_number = frame.frame_number;
    message->camera = format_.camera;
    message->sensor_in_robot = format_.sensor_in_robot;
    pair_.send(frame.stamp_ns);
  }
  if (rate_ && !job.ended()) {
    triggered_ns_ = next_release(job);
    camera_->trigger(triggered_ns_);
  }
}

}  // namespace takt
