// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <vector>

#include "hal/camera/health.hpp"
#include "hal/camera/stereo_camera.hpp"
#include "hal/device_node.hpp"
#include "rt/msg/image.hpp"
#include "rt/time/rate.hpp"

namespace takt {

/// Device kind `stereo_camera`: one StereoPair per release, stamped with its exposure, image health assessed at
/// capture.
class StereoCameraNode final : public DeviceNode {
 public:
  explicit StereoCameraNode(std::unique_ptr<StereoCamera> camera, HealthThresholds thresholds = {});
  void setup(Setup& setup) override;
  void start(int64_t epoch_ns) override;
  void run(Job& job) override;
  Device& device() override { return *camera_; }
  StereoCamera& camera() { return *camera_; }

 private:
  int64_t next_release(const Job& job) const;

  Output<StereoPair> pair_{this, "pair", "the two images of one exposure"};
  std::unique_ptr<StereoCamera> camera_;
  HealthThresholds thresholds_;
  StereoFormat format_;
  std::optional<Rate> rate_;
  int64_t offset_ns_ = 0;
  std::vector<uint8_t> previous_;
  bool has_previous_ = false, at_its_own_rate_ = false;
  int64_t triggered_ns_ = INT64_MIN;
};

}  // namespace takt
