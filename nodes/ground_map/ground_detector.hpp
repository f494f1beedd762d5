// SPDX-License-Identifier: Apache-2.0
// Which pixels of one image are floor: textures learnt in the reference area, tested everywhere (thesis Sec. 4.2.1).
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "nodes/ground_map/confidence.hpp"
#include "nodes/ground_map/mask_cleaner.hpp"
#include "nodes/ground_map/texture.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/state_archive.hpp"

namespace takt::ground_map {

struct DetectorParameters {
  TrapezoidShares trapezoid;
  double t_m = 80;           ///< px of a bin that counts, for a reference area of kDefaultAreaPx
  int memory_entries = 500;  ///< N_b: 100 s of frames
  double t_w = 0.9;          ///< weight above which a pixel is ground
  int mean_size = 9;         ///< px, odd: edge of the box average
  double light_min = 50;     ///< of light(), 0..255: a darker image says nothing
  DoubtParameters doubt;
};

/// For images of one size. Allocates in the constructor only; one thread at a time.
class GroundDetector {
 public:
  GroundDetector(int width, int height, const DetectorParameters& parameters);

  /// From the next analyse() on, with what was learnt; memory_entries stays as it was.
  void tune(const DetectorParameters& parameters);

  /// Takes an image of the constructor's size, BGR or grey (saturation 0), for the two calls below.
  void analyse(ImageView<const uint8_t> image);
  /// Mean value of the reference area of the image analysed last, 0..255.
  double light() const { return light_; }
  /// Darker than the detector was judged on: nothing is ground then, nothing is sure, and nothing is to be learnt.
  bool too_dark() const { return light_ < light_min_; }
  /// Adds the texture of the reference area to the memory; false if it is too dark or no bin was full enough.
  bool learn();
  /// 255 ground, 0 not. Before the first entry nothing is ground, and above the horizon of `camera` never.
  void classify(ImageView<uint8_t> mask, const std::optional<FloorProjection>& camera = std::nullopt);

  /// How far each pixel of the image can be trusted, by what was learnt; until the next of the calls above.
  Confidence confidence() const;

  /// Adds a texture that an earlier process learnt, or another detector.
  void recall(const Descriptor& descriptor);
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, memory_);
    if (archive.loads() && !archive.failed()) confidence_.rebuild(memory_.table());
  }

  const ReferenceArea& area() const { return area_; }
  const TextureMemory& memory() const { return memory_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  ImageView<uint8_t> view(std::vector<uint8_t>& plane) const { return {plane.data(), width_, height_}; }
  ImageView<const uint8_t> view(const std::vector<uint8_t>& plane) const { return {plane.data(), width_, height_}; }

  int width_, height_;
  double t_m_, light_min_, light_ = 0;
  ReferenceArea area_;
  TextureMemory memory_;
  ConfidenceTable confidence_;
  MaskCleaner cleaner_;
  std::vector<uint8_t> saturation_, value_, raw_;
};

}  // namespace takt::ground_map
