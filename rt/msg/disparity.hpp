// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/disparity.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// Dense disparity of the left rectified image. Capacity: width, height.
struct DisparityMap {
  static constexpr std::string_view type_name = "disparity";
  static constexpr int16_t invalid = -1;
  int32_t width = 0, height = 0;
  int32_t disparities = 0;  ///< search range: 0 .. disparities - 1
  CameraModel camera;
  Array<int16_t> disparity;   ///< px; left (x, y) is right (x - d, y); `invalid` where rejected
  Array<uint8_t> confidence;  ///< 0..255 for zeta 0..1 (thesis Eq. 3.6, corrected)
  Array<uint8_t> fraction;    ///< 1/64 px to add to the disparity, plus 32; empty: whole pixels only

  ImageView<int16_t> view() { return {disparity.data(), width, height}; }
  ImageView<const int16_t> view() const { return {disparity.data(), width, height}; }
  ImageView<uint8_t> confidence_view() { return {confidence.data(), width, height}; }
  ImageView<const uint8_t> confidence_view() const { return {confidence.data(), width, height}; }
  ImageView<uint8_t> fraction_view() { return {fraction.data(), width, height}; }
  ImageView<const uint8_t> fraction_view() const { return {fraction.data(), width, height}; }
  bool sound() const { return image_fits(width, height, 1, disparity.capacity); }
  void show(Viewer& to) const {
    to.disparity(view(), disparities);
    if (camera.focal_px > 0) to.camera({camera, width, height});
  }
  TAKT_FIELDS(DisparityMap, (width, "px"), (height, "px"), (disparities, "px"), (camera),
              (disparity, "px", capacity.pixels()), (confidence, "1", capacity.pixels()),
              (fraction, "1/64 px", capacity.pixels()))
};

}  // namespace takt
