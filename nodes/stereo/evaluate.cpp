// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace takt::stereo {
namespace {

template <class T, class Convert>
DisparityImage convert(ImageView<const T> in, Convert value) {
  DisparityImage out{in.width, in.height,
                     std::vector<float>(static_cast<size_t>(in.width) * static_cast<size_t>(in.height))};
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) out.at(x, y) = value(in.at(x, y));
  return out;
}

double percent(int64_t part, int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

void check_scale(double scale) {
  if (!(scale > 0) || !std::isfinite(scale))
    throw std::invalid_argument("ground-truth scale is " + std::to_string(scale) + ", must be positive");
}

}  // namespace

DisparityImage ground_truth(ImageView<const uint8_t> image, double scale) {
  check_scale(scale);
  return convert(image, [scale](uint8_t v) { return static_cast<float>(v / scale); });
}

DisparityImage ground_truth(ImageView<const uint16_t> image, double scale) {
  check_scale(scale);
  return convert(image, [scale](uint16_t v) { return static_cast<float>(v / scale); });
}

DisparityImage to_disparity_image(ImageView<const int16_t> disparity) {
  return convert(disparity, [](int16_t d) { return static_cast<float>(d); });
}

DisparityImage to_disparity_image(const DisparityViews& views) {
  DisparityImage out = to_disparity_image(views.disparity);
  if (views.fraction.data == nullptr) return out;
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      if (out.at(x, y) >= 0)
        out.at(x, y) += static_cast<float>(views.fraction.at(x, y) - kNoFraction) / static_cast<float>(kFractions);
  return out;
}

std::vector<uint8_t> visible_in_right(const DisparityImage& truth) {
  const int w = truth.width;
  std::vector<uint8_t> visible(truth.pixels.size());
  std::vector<float> nearest(static_cast<size_t>(w) + 2);
  for (int y = 0; y < truth.height; ++y) {
    // The largest disparity that lands in (column - 1, column + 1) of the right image, in cells of one pixel.
    std::fill(nearest.begin(), nearest.end(), 0.0f);
    const auto landing = [&](int x) { return static_cast<float>(x) - truth.at(x, y); };
    for (int x = 0; x < w; ++x) {
      const float xr = landing(x);
      if (!(truth.at(x, y) > 0) || !(xr >= 0)) continue;
      const auto cell = static_cast<size_t>(xr);
      nearest[cell] = std::max(nearest[cell], truth.at(x, y));
      if (xr > std::floor(xr)) nearest[cell + 1] = std::max(nearest[cell + 1], truth.at(x, y));
    }
    for (int x = 0; x < w; ++x) {
      const float d = truth.at(x, y), xr = landing(x);
      if (!(d > 0) || !(xr >= 0)) continue;
      visible[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)] =
          nearest[static_cast<size_t>(std::lround(xr))] > d + 0.5f ? 0 : 1;
    }
  }
  return visible;
}

StereoScore score(const DisparityImage& disparity, const DisparityImage& truth) {
  if (disparity.width != truth.width || disparity.height != truth.height)
    throw std::invalid_argument("disparity is " + std::to_string(disparity.width) + " x " +
                                std::to_string(disparity.height) + ", ground truth " + std::to_string(truth.width) +
                                " x " + std::to_string(truth.height) + " px; give images of one size");
  const auto visible = visible_in_right(truth);
  StereoScore s;
  int64_t bad = 0, bad_all = 0, bad_half = 0, found = 0;
  for (size_t i = 0; i < truth.pixels.size(); ++i) {
    const float t = truth.pixels[i], d = disparity.pixels[i];
    if (!(t > 0)) continue;
    const bool present = d >= -0.5f, wrong = !present || !(std::abs(d - t) <= 1);
    ++s.known;
    s.visible += visible[i];
    found += present;
    bad_all += wrong;
    bad += wrong && visible[i] != 0;
    bad_half += visible[i] != 0 && (!present || !(std::abs(d - t) <= 0.5f));
  }
  s.bad_1px_pct = percent(bad, s.visible);
  s.bad_1px_all_pct = percent(bad_all, s.known);
  s.bad_half_px_pct = percent(bad_half, s.visible);
  s.density_pct = percent(found, s.known);
  return s;
}

}  // namespace takt::stereo
