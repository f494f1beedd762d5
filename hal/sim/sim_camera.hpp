// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pthread.h>

#include <atomic>
#include <memory>
#include <thread>

#include "hal/camera/rig.hpp"
#include "hal/camera/stereo_camera.hpp"
#include "hal/device_thread.hpp"
#include "hal/sim/lens.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt::sim {

struct SimCameraSettings {
  StereoRig rig;
  SensorNoise noise;
  Rate rate{15, 1};        ///< of exposures while nobody triggers
  bool is_read = true;     ///< false: somebody only wants to know its format, and nothing is made for images
  bool background = true;  ///< render ahead of time in a thread of its own; ignored with a virtual clock
};

/// A stereo camera that looks at the simulated world.
///
/// trigger(t) with t ahead of now has that exposure rendered in the camera's own thread, "sim:" and its id (15 letters
/// at most), as soon as no command can change what it shows; read() then merely copies. The thread is an ordinary one;
/// once a real-time thread triggers, it takes the lowest real-time priority, behind every worker: a camera's hardware
/// is not slowed by what else the machine does. If the frame is not ready, or the robot turned out to be elsewhere, or
/// the clock is virtual, read() renders itself: what is delivered depends on the exposure's stamp alone, never on
/// timing. Started in the midst of a run, with its own thread, it gives nothing until an exposure was asked for in
/// time, as hardware does. Nobody triggered: the camera runs free at `rate` from the epoch, and a read gives the newest
/// exposure that was not delivered.
class SimCamera final : public StereoCamera {
 public:
  SimCamera(std::string id, SimCameraSettings settings, Simulation& simulation, const Clock& clock);
  ~SimCamera() override;

  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  /// Of one that is triggered for each read.
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  StereoFormat format() const override;
  void trigger(int64_t at_ns) override;
  StereoFrame read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) override;

  /// Reads that found their frame rendered in the background, and all reads that delivered.
  uint64_t rendered_ahead() const { return rendered_ahead_; }
  uint64_t delivered() const { return delivered_; }
  /// What this camera's share of simulator_cost() is.
  SimulatorCost cost() const { return cost_.read(); }
  /// True if the background thread has nothing left to render.
  bool idle() const { return done_.load(std::memory_order_acquire) == asked_.load(std::memory_order_acquire); }

 private:
  struct Request {
    int64_t at_ns = 0;
    CameraPose pose[2];
    Snapshot snapshot;
    bool operator==(const Request& other) const;
  };
  /// Rendering begins at the latest this long before the exposure: several times what a pair costs.
  static constexpr int64_t kLatestStartNs = 50'000'000;
  void work();
  void wait_until_settled(int64_t at_ns, uint32_t asked) const;
  void request(int64_t at_ns, Request& into) const;
  void render(Lens& lens, const Request& request, ImageView<uint8_t> left, ImageView<uint8_t> right) const;

  std::string id_;
  SimCameraSettings settings_;
  Simulation& simulation_;
  const Clock& clock_;
  std::unique_ptr<Lens> lens_, background_lens_;
  std::vector<uint8_t> prepared_[2];

  int64_t triggered_ns_ = 0;
  bool has_trigger_ = false, ever_triggered_ = false, started_ = false;
  bool starting_ = false;  ///< in the midst of a run: no exposure has been asked for in time yet
  uint32_t triggers_ = 0;
  int64_t next_free_frame_ = 0;
  uint64_t rendered_ahead_ = 0, delivered_ = 0;

  // Hand-over to the background thread: it writes `prepared_` and `made_` only while done_ != asked_, the reader looks
  // at them only while they are equal. Asked again while it draws, the thread goes on with the newest wish, so that a
  // frame that came too late costs one read only.
  std::atomic<int64_t> asked_at_ns_{0};
  Request made_, wanted_;
  std::atomic<uint32_t> asked_{0}, done_{0};
  std::atomic<bool> quit_{false};
  DevicePriority priority_;
  std::thread worker_;
  CostCounter cost_;
};

}  // namespace takt::sim
