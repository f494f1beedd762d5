// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/half_resolution.hpp"

#include <cstring>
#include <stdexcept>

namespace takt::stereo {
namespace {

/// Windows shrink with the image, to the next odd edge: they then see about as much of the scene as at full size.
MatcherParameters halved(MatcherParameters p) {
  const auto odd_half = [](int edge) { return (edge + 1) / 2 | 1; };
  p.disparities = (p.disparities + 1) / 2;
  p.n_square = odd_half(p.n_square);
  p.n_min = odd_half(p.n_min);
  return p;
}

/// What is wrong is told of the parameters as they were given.
const MatcherParameters& checked(const MatcherParameters& p, int width, int height, int channels) {
  if (const auto wrong = problem(p, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  return p;
}

size_t pixels(int width, int height) { return static_cast<size_t>(half(width)) * static_cast<size_t>(half(height)); }

template <class T>
void copy_row(const T* from, int count, T* to) {
  std::memcpy(to, from, static_cast<size_t>(count) * sizeof(T));
}

}  // namespace

void halve(ImageView<const uint8_t> in, ImageView<uint8_t> out) {
  for (int y = 0; y < out.height; ++y) {
    const uint8_t* a = in.row(2 * y);
    const uint8_t* b = in.row(std::min(2 * y + 1, in.height - 1));
    uint8_t* o = out.row(y);
    const int n = in.channels, right = in.width > 1 ? n : 0;
    for (int x = 0; x < out.width; ++x, a += 2 * n, b += 2 * n, o += n)
      for (int c = 0; c < n; ++c) o[c] = static_cast<uint8_t>((a[c] + a[c + right] + b[c] + b[c + right] + 2) >> 2);
  }
}

void enlarge(ImageView<const int16_t> disparity, ImageView<const uint8_t> confidence, ImageView<int16_t> disparity_out,
             ImageView<uint8_t> confidence_out) {
  const int width = disparity_out.width, last = disparity.width - 1;
  for (int y = 0; y < disparity_out.height; ++y) {
    int16_t* d_out = disparity_out.row(y);
    uint8_t* c_out = confidence_out.row(y);
    if (y % 2 == 1) {
      copy_row(disparity_out.row(y - 1), width, d_out);
      copy_row(confidence_out.row(y - 1), width, c_out);
      continue;
    }
    const int from = std::min(y / 2, disparity.height - 1);
    const int16_t* d = disparity.row(from);
    const uint8_t* c = confidence.row(from);
    for (int x = 0; x < width; ++x) {
      const int at = std::min(x / 2, last);
      d_out[x] = static_cast<int16_t>(d[at] < 0 ? -1 : 2 * d[at]);
      c_out[x] = c[at];
    }
  }
}

HalfMatcher::HalfMatcher(int width, int height, int channels, const MatcherParameters& parameters)
    : width_(width),
      height_(height),
      channels_(channels),
      matcher_(half(width), half(height), channels, halved(checked(parameters, width, height, channels))),
      left_(pixels(width, height) * static_cast<size_t>(channels)),
      right_(left_.size()),
      confidence_(pixels(width, height)),
      disparity_(pixels(width, height)) {}

bool HalfMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<int16_t> disparity,
                        ImageView<uint8_t> confidence) {
  const auto fits = [&](const auto& view, int channels) {
    return view.width == width_ && view.height == height_ && view.channels == channels && view.data != nullptr;
  };
  if (!fits(left, channels_) || !fits(right, channels_) || !fits(disparity, 1) || !fits(confidence, 1)) return false;
  const int w = half(width_), h = half(height_);
  const ImageView<uint8_t> half_left(left_.data(), w, h, channels_), half_right(right_.data(), w, h, channels_);
  const ImageView<int16_t> half_disparity(disparity_.data(), w, h);
  const ImageView<uint8_t> half_confidence(confidence_.data(), w, h);
  halve(left, half_left);
  halve(right, half_right);
  if (!matcher_.match(half_left, half_right, half_disparity, half_confidence)) return false;
  enlarge(half_disparity, half_confidence, disparity, confidence);
  return true;
}

}  // namespace takt::stereo
