// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "hal/camera/rig.hpp"
#include "hal/sim/renderer.hpp"

namespace takt::sim {

/// A renderer with the lens of a rig: an ideal pinhole if the rig is rectified, else a wider ideal image resampled by
/// the Brown distortion model (bilinear, map computed once). Not thread-safe.
class Lens {
 public:
  explicit Lens(const StereoRig& rig);
  void render(const Scene& scene, const CameraPose& pose, const SensorNoise& noise, uint64_t noise_seed,
              ImageView<uint8_t> image);

 private:
  struct Tap {
    uint32_t index;  ///< of the upper left neighbour in the wide image
    uint8_t wx, wy;  ///< weights in 1/128
  };
  Pinhole wide_;
  Renderer renderer_;
  std::vector<Tap> taps_;  ///< empty for an ideal lens
  std::vector<uint8_t> image_;
};

}  // namespace takt::sim
