// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/lens.hpp"

#include <algorithm>
#include <cmath>

namespace takt::sim {
namespace {

struct Normalised {
  double x, y;
};

Normalised distort(const std::array<double, 5>& k, Normalised p) {
  const double r2 = p.x * p.x + p.y * p.y, radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {p.x * radial + 2 * k[2] * p.x * p.y + k[3] * (r2 + 2 * p.x * p.x),
          p.y * radial + k[2] * (r2 + 2 * p.y * p.y) + 2 * k[3] * p.x * p.y};
}

/// Inverse of the Brown model by fixed-point iteration; converges for the mild distortions of real lenses.
Normalised undistort(const std::array<double, 5>& k, Normalised d) {
  Normalised p = d;
  for (int i = 0; i < 50; ++i) {
    const Normalised q = distort(k, p);
    p.x += d.x - q.x;
    p.y += d.y - q.y;
  }
  return p;
}

bool ideal(const StereoRig& rig) {
  return rig.rectified || std::all_of(rig.distortion.begin(), rig.distortion.end(), [](double k) { return k == 0; });
}

Normalised ray(const StereoRig& rig, double x, double y) {
  return undistort(rig.distortion, {(x - rig.cu_px) / rig.focal_px, (y - rig.cv_px) / rig.focal_px});
}

/// The smallest ideal image that contains every ray of the distorted one.
Pinhole wide_camera(const StereoRig& rig) {
  Pinhole camera{rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px};
  if (ideal(rig)) return camera;
  double x_reach = 0, y_reach = 0;
  for (int i = 0; i <= 64; ++i) {
    const double x = (rig.width - 1) * i / 64.0, y = (rig.height - 1) * i / 64.0;
    for (const Normalised p :
         {ray(rig, x, 0), ray(rig, x, rig.height - 1), ray(rig, 0, y), ray(rig, rig.width - 1, y)}) {
      x_reach = std::max(x_reach, std::abs(p.x));
      y_reach = std::max(y_reach, std::abs(p.y));
    }
  }
  const int half_width = static_cast<int>(std::ceil(std::min(x_reach, 4.0) * rig.focal_px)) + 2;
  const int half_height = static_cast<int>(std::ceil(std::min(y_reach, 4.0) * rig.focal_px)) + 2;
  return {2 * half_width + 1, 2 * half_height + 1, rig.focal_px, static_cast<double>(half_width),
          static_cast<double>(half_height)};
}

}  // namespace

Lens::Lens(const StereoRig& rig) : wide_(wide_camera(rig)), renderer_(wide_) {
  if (ideal(rig)) return;
  image_.resize(static_cast<size_t>(wide_.width) * static_cast<size_t>(wide_.height) *
                static_cast<size_t>(rig.channels));
  for (int y = 0; y < rig.height; ++y) {
    for (int x = 0; x < rig.width; ++x) {
      const Normalised p = ray(rig, x, y);
      const double u = std::clamp(p.x * wide_.focal_px + wide_.cu_px, 0.0, wide_.width - 2.0);
      const double v = std::clamp(p.y * wide_.focal_px + wide_.cv_px, 0.0, wide_.height - 2.0);
      const int iu = static_cast<int>(u), iv = static_cast<int>(v);
      taps_.push_back({static_cast<uint32_t>((iv * wide_.width + iu) * rig.channels),
                       static_cast<uint8_t>(std::lround((u - iu) * 128)),
                       static_cast<uint8_t>(std::lround((v - iv) * 128))});
    }
  }
}

void Lens::render(const Scene& scene, const CameraPose& pose, const SensorNoise& noise, uint64_t noise_seed,
                  ImageView<uint8_t> image) {
  if (taps_.empty()) return renderer_.render(scene, pose, noise, noise_seed, image);
  renderer_.render(scene, pose, noise, noise_seed, {image_.data(), wide_.width, wide_.height, image.channels});
  const auto channels = static_cast<size_t>(image.channels), below = channels * static_cast<size_t>(wide_.width);
  const Tap* tap = taps_.data();
  for (int y = 0; y < image.height; ++y) {
    uint8_t* out = image.row(y);
    for (int x = 0; x < image.width; ++x, ++tap) {
      const uint8_t* in = image_.data() + tap->index;
      for (size_t c = 0; c < channels; ++c, ++in) {
        const int top = in[0] * (128 - tap->wx) + in[channels] * tap->wx;
        const int bottom = in[below] * (128 - tap->wx) + in[below + channels] * tap->wx;
        *out++ = static_cast<uint8_t>((top * (128 - tap->wy) + bottom * tap->wy + 8192) >> 14);
      }
    }
  }
}

}  // namespace takt::sim
