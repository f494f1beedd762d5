// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/confidence.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ground_map {

ConfidenceTable::ConfidenceTable(const DoubtParameters& parameters) : above_(257 * 256), table_(256 * 256, kSure) {
  tune(parameters);
  rebuild(std::vector<uint8_t>(256 * 256).data());
}

void ConfidenceTable::tune(const DoubtParameters& parameters) {
  p_ = parameters;
  const auto values = [](double low, double high) {
    return Values{std::clamp(static_cast<int>(std::ceil(low)), 0, 256),
                  std::clamp(static_cast<int>(std::floor(high)) + 1, 0, 256)};
  };
  for (int v = 0; v < 256; ++v)
    other_light_[static_cast<size_t>(v)] = {values(v / p_.shade_faintest, v / p_.shade_deepest),
                                            values(v * p_.shade_deepest, v * p_.shade_faintest)};
}

// Whether there is ground in a rectangle of values and saturations: sums along the values, then along the saturations.
void ConfidenceTable::rebuild(const uint8_t* is_ground) {
  for (size_t i = 0; i < 256 * 256; ++i) above_[i + 256] = above_[i] + is_ground[i];
  std::array<int32_t, 257> before{};  // ground of smaller saturations, in both ranges of values
  for (size_t v = 0; v < 256; ++v) {
    uint8_t* out = table_.data() + 256 * v;
    if (static_cast<int>(v) >= p_.bloom_value) {
      std::fill_n(out, 256, p_.doubtful);
      continue;
    }
    for (size_t s = 0; s < 256; ++s) {
      before[s + 1] = before[s];
      for (const auto& [low, high] : other_light_[v])
        if (low < high)
          before[s + 1] += above_[256 * static_cast<size_t>(high) + s] - above_[256 * static_cast<size_t>(low) + s];
    }
    for (int s = 0; s < 256; ++s) {
      const int first = std::max(0, s - p_.shade_saturation), last = std::min(255, s + p_.shade_saturation);
      const bool other_light = before[static_cast<size_t>(last) + 1] > before[static_cast<size_t>(first)];
      out[s] = other_light && !is_ground[256 * v + static_cast<size_t>(s)] ? p_.doubtful : kSure;
    }
  }
}

}  // namespace takt::ground_map
