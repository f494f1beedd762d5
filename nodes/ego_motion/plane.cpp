// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/plane.hpp"

#include <cstring>

namespace takt::ego_motion {

void to_grey(ImageView<const uint8_t> image, Plane& out) {
  const int width = out.width();
  for (int y = 0; y < out.height(); ++y) {
    const uint8_t* in = image.row(y);
    uint8_t* to = out.row(y);
    if (image.channels == 1) {
      std::memcpy(to, in, static_cast<size_t>(width));
      continue;
    }
    for (int x = 0; x < width; ++x)
      to[x] = static_cast<uint8_t>((29u * in[3 * x] + 150u * in[3 * x + 1] + 77u * in[3 * x + 2] + 128u) >> 8);
  }
}

void halve(const Plane& in, Plane& out) {
  for (int y = 0; y < out.height(); ++y) {
    const uint8_t* a = in.row(2 * y);
    const uint8_t* b = in.row(2 * y + 1);
    uint8_t* to = out.row(y);
    for (int x = 0; x < out.width(); ++x)
      to[x] = static_cast<uint8_t>((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) >> 2);
  }
}

Pyramid::Pyramid(int width, int height, int levels) {
  for (int l = 0; l < levels; ++l) levels_.emplace_back(width >> l, height >> l);
}

void Pyramid::build(ImageView<const uint8_t> image) {
  to_grey(image, levels_[0]);
  for (size_t l = 1; l < levels_.size(); ++l) halve(levels_[l - 1], levels_[l]);
}

}  // namespace takt::ego_motion
