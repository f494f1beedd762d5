// SPDX-License-Identifier: Apache-2.0
// Quality of a ground mask, from this detector or any other, against ground truth.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/ground_map/confidence.hpp"
#include "nodes/ground_map/floor_projection.hpp"
#include "nodes/ground_map/ground_detector.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::ground_map {

/// One image as the node maps it: learns if its reference area is free, calls its ground, adds it to the map.
/// `in_robot` leads to the robot frame.
void map_image(ImageView<const uint8_t> image, const FloorProjection& in_robot, const PlanarPose& robot_in_map,
               GroundDetector& detector, GroundGrid& grid, ImageView<uint8_t> mask, bool area_free = true);

/// Ground truth of a pixel.
enum class Truth : uint8_t { other = 0, ground = 1, ignored = 2 };

/// Pixels counted over any number of images.
struct MaskScore {
  int64_t right = 0;             ///< called ground, and ground
  int64_t wrong = 0;             ///< called ground, but not
  int64_t missed = 0;            ///< ground, but not called so
  double precision_pct() const;  ///< 0 where nothing was called ground
  double recall_pct() const;     ///< 0 where there is none
};

/// Adds an image; `mask` 0 or not, `truth` values of Truth, equally large.
void add(MaskScore& score, ImageView<const uint8_t> mask, ImageView<const uint8_t> truth);

/// For every column of an image how far the floor is free: distance (m, on the floor, from the camera's foot) of its
/// lowest pixel that is not ground, at most range_max. `is_ground` is the value that a ground pixel has.
std::vector<double> free_range(ImageView<const uint8_t> mask, uint8_t is_ground, const FloorProjection& projection,
                               const FloorPoint& camera_foot, double range_max_m);

/// Adds |a - b| of the columns where one of them is below range_max.
void add_border_errors(const std::vector<double>& a, const std::vector<double>& b, double range_max_m,
                       std::vector<double>& errors);

/// Borders that the confidence doubts: of those that are none (the floor goes on) and of those that are one.
struct DoubtScore {
  int64_t false_borders = 0, false_doubted = 0;
  int64_t true_borders = 0, true_doubted = 0;
  double false_doubted_pct() const;
  double true_doubted_pct() const;
};

/// Adds the lowest pixel of each column that is not ground in `mask`; its confidence is read `beyond_px` above.
void add(DoubtScore& score, ImageView<const uint8_t> mask, ImageView<const uint8_t> truth, const Confidence& confidence,
         int beyond_px);

/// The trivial method to compare with: the lowest 40 % of the rows are ground.
void bottom_is_ground(ImageView<uint8_t> mask);

}  // namespace takt::ground_map
