// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/ground_detector.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "nodes/ground_map/saturation_value.hpp"

namespace takt::ground_map {

GroundDetector::GroundDetector(int width, int height, const DetectorParameters& parameters)
    : width_(width),
      height_(height),
      t_m_(parameters.t_m),
      light_min_(parameters.light_min),
      area_(width, height, parameters.trapezoid),
      memory_(parameters.memory_entries, parameters.t_w),
      confidence_(parameters.doubt),
      cleaner_(width, height, parameters.mean_size) {
  for (auto* plane : {&saturation_, &value_, &raw_})
    plane->resize(static_cast<size_t>(width) * static_cast<size_t>(height));
}

void GroundDetector::tune(const DetectorParameters& parameters) {
  t_m_ = parameters.t_m;
  light_min_ = parameters.light_min;
  area_.tune(parameters.trapezoid);
  memory_.tune(parameters.t_w);
  confidence_.tune(parameters.doubt);
  confidence_.rebuild(memory_.table());
  cleaner_.tune(parameters.mean_size);
}

void GroundDetector::analyse(ImageView<const uint8_t> image) {
  for (int y = 0; y < height_; ++y) {
    uint8_t *s = view(saturation_).row(y), *v = view(value_).row(y);
    if (image.channels == 3) {
      saturation_value_row(image.row(y), width_, s, v);
    } else {
      std::fill_n(s, width_, uint8_t{0});
      std::copy_n(image.row(y), width_, v);
    }
  }
  int64_t sum = 0;
  for (const RowSpan& span : area_.spans()) {
    const uint8_t* row = view(value_).row(span.y);
    sum += std::accumulate(row + span.first, row + span.last, int64_t{0});
  }
  light_ = static_cast<double>(sum) / static_cast<double>(std::max<int64_t>(area_.pixels(), 1));
}

bool GroundDetector::learn() {
  if (too_dark()) return false;
  const auto descriptor = describe(view(saturation_), view(value_), area_, t_m_);
  if (descriptor) recall(*descriptor);
  return descriptor.has_value();
}

void GroundDetector::recall(const Descriptor& descriptor) {
  memory_.add(descriptor);
  confidence_.rebuild(memory_.table());
}

Confidence GroundDetector::confidence() const {
  static constexpr std::array<uint8_t, 256 * 256> kNothingSure{};
  return {too_dark() ? kNothingSure.data() : confidence_.table(), view(saturation_), view(value_)};
}

void GroundDetector::classify(ImageView<uint8_t> mask, const std::optional<FloorProjection>& camera) {
  if (too_dark()) {
    for (int y = 0; y < height_; ++y) std::fill_n(mask.row(y), width_, uint8_t{0});
    return;
  }
  // Pointers of its own: bytes that are written could otherwise be those of the vectors themselves.
  const uint8_t *table = memory_.table(), *s = saturation_.data(), *v = value_.data();
  uint8_t* out = raw_.data();
  for (size_t i = 0, n = raw_.size(); i < n; ++i) out[i] = table[size_t{v[i]} * 256 + s[i]];
  if (camera)
    for (int y = 0; y < height_; ++y) {
      const RowSpan floor = camera->floor_of_row(y, width_);
      uint8_t* row = view(raw_).row(y);
      std::fill(row, row + floor.first, uint8_t{0});
      std::fill(row + floor.last, row + width_, uint8_t{0});
    }
  cleaner_.clean(view(raw_), area_, mask);
}

}  // namespace takt::ground_map
