// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/sim_camera.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "hal/sim/random.hpp"

namespace takt::sim {
namespace {

void copy(const std::vector<uint8_t>& from, ImageView<uint8_t> to) {
  const size_t row = static_cast<size_t>(to.width) * static_cast<size_t>(to.channels);
  for (int y = 0; y < to.height; ++y) std::memcpy(to.row(y), from.data() + static_cast<size_t>(y) * row, row);
}

}  // namespace

bool SimCamera::Request::operator==(const Request& other) const {
  const auto same = [&](int which) {
    return pose[which].rotation == other.pose[which].rotation && pose[which].position == other.pose[which].position;
  };
  return at_ns == other.at_ns && same(0) && same(1) && snapshot.placed == other.snapshot.placed;
}

SimCamera::SimCamera(std::string id, SimCameraSettings settings, Simulation& simulation, const Clock& clock)
    : id_(std::move(id)), settings_(std::move(settings)), simulation_(simulation), clock_(clock) {}

SimCamera::~SimCamera() {
  stop();
  close();
}

DeviceResult SimCamera::open() {
  if (lens_) return {};
  const StereoRig& rig = settings_.rig;
  if (rig.channels != 1 && rig.channels != 3) {
    return device_error(id_, "the rig has " + std::to_string(rig.channels) + " channels", "use 1 (grey) or 3 (BGR)");
  }
  if (settings_.is_read) simulation_.scene().textures->make();
  lens_ = std::make_unique<Lens>(rig);
  for (Request* request : {&made_, &wanted_}) request->snapshot = simulation_.make_snapshot();
  if (settings_.background && !clock_.is_virtual()) {
    background_lens_ = std::make_unique<Lens>(rig);
    for (auto& image : prepared_) {
      image.assign(static_cast<size_t>(rig.width) * static_cast<size_t>(rig.height) * static_cast<size_t>(rig.channels),
                   0);
    }
  }
  return {};
}

void SimCamera::close() {
  lens_.reset();
  background_lens_.reset();
}

DeviceResult SimCamera::start(int64_t epoch_ns) {
  if (!lens_) return device_error(id_, "start before open", "call open() first");
  simulation_.begin(epoch_ns);
  has_trigger_ = ever_triggered_ = false;
  triggers_ = 0;
  next_free_frame_ = 0;
  started_ = true;
  starting_ = background_lens_ && clock_.now_ns() >= epoch_ns;
  if (background_lens_ && !worker_.joinable()) {
    quit_.store(false);
    worker_ = std::thread([this] { work(); });
  }
  return {};
}

void SimCamera::stop() {
  started_ = false;
  if (!worker_.joinable()) return;
  quit_.store(true);
  asked_.fetch_add(1);
  asked_.notify_one();
  worker_.join();
  done_.store(0);
  asked_.store(0);
}

StereoFormat SimCamera::format() const {
  const StereoRig& rig = settings_.rig;
  return {rig.width, rig.height, rig.channels, rig.rectified, rig.camera(), 0, camera_in_robot(rig, 0, 0)};
}

void SimCamera::request(int64_t at_ns, Request& into) const {
  into.at_ns = at_ns;
  for (const int which : {0, 1}) into.pose[which] = simulation_.camera_pose(settings_.rig, which, at_ns);
  simulation_.look(at_ns, into.snapshot);
}

void SimCamera::trigger(int64_t at_ns) {
  starting_ = starting_ && at_ns - clock_.now_ns() < std::min(kLatestStartNs, settings_.rate.release_ns(0, 1) / 2);
  triggered_ns_ = at_ns;
  priority_.follow();
  ever_triggered_ = true;
  has_trigger_ = !starting_;
  ++triggers_;
  if (!worker_.joinable() || starting_) return;
  asked_at_ns_.store(at_ns, std::memory_order_relaxed);
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_one();
}

void SimCamera::work() {
  pthread_setname_np(pthread_self(), ("sim:" + id_).substr(0, 15).c_str());
  const StereoRig& rig = settings_.rig;
  uint32_t seen = 0;
  priority_.keep(clock_);  // frames that come late for it are drawn by read()
  for (;;) {
    asked_.wait(seen, std::memory_order_acquire);
    if (quit_.load()) return;
    seen = asked_.load(std::memory_order_acquire);
    priority_.keep(clock_);
    const int64_t at_ns = asked_at_ns_.load(std::memory_order_relaxed);
    wait_until_settled(at_ns, seen);
    if (quit_.load()) return;
    if (asked_.load() != seen) continue;
    const int64_t before = thread_cpu_ns();
    request(at_ns, made_);
    render(*background_lens_, made_, {prepared_[0].data(), rig.width, rig.height, rig.channels},
           {prepared_[1].data(), rig.width, rig.height, rig.channels});
    cost_.add({thread_cpu_ns() - before, 0});
    done_.store(seen, std::memory_order_release);
  }
}

/// A robot or head that is under way may still be sent elsewhere, an action may still change what is seen: drawn before
/// that is settled, a frame is drawn in vain, and read() has to do it again within its job. A camera of 5 Hz is
/// triggered long before.
void SimCamera::wait_until_settled(int64_t at_ns, uint32_t asked) const {
  while (asked_.load() == asked && !simulation_.settled(settings_.rig.on_head, at_ns) &&
         clock_.now_ns() < at_ns - kLatestStartNs) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

void SimCamera::render(Lens& lens, const Request& request, ImageView<uint8_t> left, ImageView<uint8_t> right) const {
  // Noise belongs to the exposure's place in the run, so that two runs of one seed see the same.
  const uint64_t exposure = mix(simulation_.seed(), static_cast<uint64_t>(request.at_ns - simulation_.epoch_ns()));
  lens.render(request.snapshot.scene, request.pose[0], settings_.noise, mix(exposure, 1), left);
  lens.render(request.snapshot.scene, request.pose[1], settings_.noise, mix(exposure, 2), right);
}

StereoFrame SimCamera::read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) {
  StereoFrame frame;
  if (!started_) return frame;
  int64_t at_ns = triggered_ns_;
  if (has_trigger_) {
    frame.frame_number = triggers_ - 1;
    if (at_ns > deadline_ns) return frame;
  } else {
    const int64_t now = clock_.now_ns(), epoch = simulation_.epoch_ns();
    if (ever_triggered_ || now < epoch) return frame;
    const int64_t newest = settings_.rate.releases_before(epoch, now + 1) - 1;
    if (newest < next_free_frame_) return frame;
    at_ns = settings_.rate.release_ns(epoch, newest);
    frame.frame_number = static_cast<uint32_t>(newest);
    next_free_frame_ = newest + 1;
  }
  has_trigger_ = false;
  request(at_ns, wanted_);
  const bool ready = worker_.joinable() &&
                     done_.load(std::memory_order_acquire) == asked_.load(std::memory_order_relaxed) &&
                     asked_.load(std::memory_order_relaxed) != 0 && made_ == wanted_;
  if (ready) {
    copy(prepared_[0], left);
    copy(prepared_[1], right);
    ++rendered_ahead_;
  } else {
    const int64_t before = thread_cpu_ns();
    render(*lens_, wanted_, left, right);
    cost_.add({0, thread_cpu_ns() - before});
  }
  ++delivered_;
  frame.status = ReadStatus::ok;
  frame.stamp_ns = at_ns;
  return frame;
}

}  // namespace takt::sim
