// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/generated_pair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace takt::stereo {
namespace {

/// Random grey levels of mean 128, smooth over about 3 px, with the standard deviation asked for.
class Texture {
 public:
  Texture(int width, int height, double contrast, std::mt19937_64& random)
      : width_(width), values_(static_cast<size_t>(width) * static_cast<size_t>(height)) {
    std::normal_distribution<double> level(0, 1);
    std::vector<double> rough(values_.size());
    for (double& v : rough) v = level(random);
    const auto at = [&](int x, int y) {
      return rough[static_cast<size_t>(std::clamp(y, 0, height - 1)) * static_cast<size_t>(width) +
                   static_cast<size_t>(std::clamp(x, 0, width - 1))];
    };
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int l = -1; l <= 1; ++l)
          for (int k = -1; k <= 1; ++k) sum += at(x + k, y + l);
        values_[index(x, y)] = 128 + contrast * sum / 3;  // nine of deviation 1
      }
  }
  /// Linear between columns.
  double at(double x, int y) const {
    const double inside = std::clamp(x, 0.0, static_cast<double>(width_ - 1));
    const int left = std::min(static_cast<int>(inside), width_ - 2);
    const double part = inside - left;
    return (1 - part) * values_[index(left, y)] + part * values_[index(left + 1, y)];
  }

 private:
  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  int width_;
  std::vector<double> values_;
};

/// Upright box in units of the image size, at a share of the search range.
struct Box {
  double left, top, right, bottom, share;
};
constexpr std::array<Box, 3> kBoxes{
    {{0.16, 0.17, 0.35, 0.62, 0.6}, {0.47, 0.31, 0.66, 0.54, 0.4}, {0.72, 0.12, 0.94, 0.83, 0.8}}};

}  // namespace

// Each surface has a texture of its own, laid out in columns of the right image: left pixel x shows column x - d.
GeneratedPair generate_pair(int width, int height, int disparities, double contrast, double noise_sigma,
                            uint64_t seed) {
  std::mt19937_64 random(seed);
  GeneratedPair pair;
  pair.width = width;
  pair.height = height;
  pair.left.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * 3);
  pair.right.resize(pair.left.size());
  pair.truth = {width, height, std::vector<float>(pair.left.size() / 3)};
  const auto ground = [&](int y) { return disparities * (0.05 + 0.45 * y / height); };
  const auto holds = [&](const Box& b, double x, int y) {
    return x >= b.left * width && x < b.right * width && y >= b.top * height && y < b.bottom * height;
  };
  std::vector<std::array<Texture, 3>> textures;
  for (size_t i = 0; i <= kBoxes.size(); ++i)
    textures.push_back({Texture(width, height, contrast, random), Texture(width, height, contrast, random),
                        Texture(width, height, contrast, random)});
  std::normal_distribution<double> noise(0, std::max(noise_sigma, 1e-12));
  const auto put = [&](std::vector<uint8_t>& image, int x, int y, size_t surface, double column) {
    for (size_t c = 0; c < 3; ++c)
      image[(static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) * 3 + c] =
          static_cast<uint8_t>(std::clamp(textures[surface][c].at(column, y) + noise(random), 0.0, 255.0) + 0.5);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      size_t in_left = 0, in_right = 0;  // surface: 0 the ground, else a box; nearer boxes hide others
      double d_left = ground(y), d_right = d_left;
      for (size_t i = 0; i < kBoxes.size(); ++i) {
        const double d = disparities * kBoxes[i].share;
        if (d > d_left && holds(kBoxes[i], x, y)) in_left = i + 1, d_left = d;
        if (d > d_right && holds(kBoxes[i], x + d, y)) in_right = i + 1, d_right = d;
      }
      pair.truth.at(x, y) = static_cast<float>(d_left);
      put(pair.left, x, y, in_left, x - d_left);
      put(pair.right, x, y, in_right, x);
    }
  return pair;
}

}  // namespace takt::stereo
