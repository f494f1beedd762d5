// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/detections.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"

namespace takt {

struct Detection {
  using scalar = float;
  float class_id, x_px, y_px, width_px, height_px, score;
};

/// Boxes in an image. Capacity: count.
struct Detections {
  static constexpr std::string_view type_name = "detections";
  int32_t image_width = 0, image_height = 0;
  float searched = 1;  ///< share of the image, 0..1: less if the job's time ran out
  Array<Detection> boxes;
  TAKT_FIELDS(Detections, (image_width, "px"), (image_height, "px"), (searched, "1"), (boxes, "px"))
};

}  // namespace takt
