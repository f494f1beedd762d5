// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/plane.hpp"

#include <algorithm>
#include <cstring>

#include "nodes/ego_motion/image_kernel.hpp"
#include "nodes/stereo/image_kernels.hpp"

namespace takt::ego_motion {

void to_grey(ImageView<const uint8_t> image, Plane& out) {
  const auto count = out.width();
  for (int y = 0; y < out.height(); ++y)
    if (image.channels == 1) std::memcpy(out.row(y), image.row(y), static_cast<size_t>(count));
    else stereo::image_kernels().grey(image.row(y), count, out.row(y));
}

void halve(const Plane& in, Plane& out) {
  for (int y = 0; y < out.height(); ++y)
    image_kernels().halve(in.row(2 * y), in.row(2 * y + 1), out.width(), out.row(y));
}

void Level::fill_mean() {
  constexpr int kHalf = kWindow / 2;
  const ImageKernels& kernels = image_kernels();
  const int width = image.width(), height = image.height();
  std::fill(sums_.begin(), sums_.end(), uint16_t{0});
  for (int y = 0; y < kWindow - 1; ++y) kernels.roll(image.row(y), nullptr, width, sums_.data());
  for (int y = kHalf; y <= height - kHalf; ++y) {
    kernels.roll(image.row(y + kHalf - 1), y > kHalf ? image.row(y - kHalf - 1) : nullptr, width, sums_.data());
    uint8_t* out = mean.row(y);
    kernels.mean_of_8(sums_.data(), width - kWindow + 1, out + kHalf);
    std::fill_n(out, kHalf, out[kHalf]);
    std::fill_n(out + width - kHalf + 1, kHalf - 1, out[width - kHalf]);
  }
  const auto columns = static_cast<size_t>(width);
  for (int y = 0; y < kHalf; ++y) std::memcpy(mean.row(y), mean.row(kHalf), columns);
  for (int y = height - kHalf + 1; y < height; ++y) std::memcpy(mean.row(y), mean.row(height - kHalf), columns);
}

Pyramid::Pyramid(int width, int height, int levels) {
  for (int l = 0; l < levels; ++l) levels_.emplace_back(width >> l, height >> l);
}

void Pyramid::build(ImageView<const uint8_t> image, bool means) {
  to_grey(image, levels_[0].image);
  for (size_t l = 1; l < levels_.size(); ++l) halve(levels_[l - 1].image, levels_[l].image);
  if (!means) return;
  for (Level& level : levels_) level.fill_mean();
}

}  // namespace takt::ego_motion
