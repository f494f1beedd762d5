// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/tally.hpp"

#include <algorithm>

namespace takt::object_detection {
namespace {

bool finds(const Detection& box, const PlacedObject& object) {
  const double side = object.side;
  const auto common = [side](double from, double size, double object_from) {
    return std::max(0.0, std::min(from + size, object_from + side) - std::max(from, object_from));
  };
  const double x = common(box.x_px, box.width_px, object.x), y = common(box.y_px, box.height_px, object.y);
  return box.class_id == static_cast<float>(object.object) && 2 * x * y >= side * side;
}

}  // namespace

void Tally::add(const Scene& scene, std::span<const Detection> boxes) {
  const auto counts = [&](const Detection& box) { return box.score >= static_cast<float>(min_score_); };
  for (const PlacedObject& object : scene.objects) {
    const bool missed =
        std::none_of(boxes.begin(), boxes.end(), [&](const Detection& b) { return counts(b) && finds(b, object); });
    Occluded& alike = occluded_[std::min(kTenths - 1, static_cast<size_t>(object.occluded * 10))];
    ++objects_, ++alike.objects;
    missed_ += missed, alike.missed += missed;
  }
  for (const Detection& box : boxes)
    false_positives_ += counts(box) && std::none_of(scene.objects.begin(), scene.objects.end(),
                                                    [&](const PlacedObject& object) { return finds(box, object); });
}

double Tally::detected_pct() const {
  return objects_ == 0 ? 0 : 100.0 * static_cast<double>(objects_ - missed_) / static_cast<double>(objects_);
}

double Tally::missed_pct(size_t tenth) const {
  const Occluded& alike = occluded_[tenth];
  return alike.objects == 0 ? -1 : 100.0 * static_cast<double>(alike.missed) / static_cast<double>(alike.objects);
}

}  // namespace takt::object_detection
