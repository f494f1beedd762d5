// SPDX-License-Identifier: Apache-2.0
// How much the first stage excludes and what it misses, on generated scenes (R-6.10: 75 - 80 % of the
// windows in the original).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/scenes.hpp"

namespace takt::object_detection {

/// Shares at one factor on all thresholds.
struct Exclusion {
  double excluded_pct = 0;  ///< of all windows: pass for no object
  double missed_pct = 0;    ///< of all objects: no window that covers at least half of it passes for it
};

/// For each window and each object the factor on the thresholds from which on it passes.
struct Measurement {
  std::vector<float> window_factor;  ///< any object
  std::vector<float> object_factor;  ///< the object's own, over the windows that cover at least half of it
  size_t covering_windows = 0;       ///< windows that cover at least half of an object: more cannot rightly pass

  Exclusion at(double factor) const;
  /// The smallest factor at which no object is missed, and a little more: passing means to lie below it.
  double no_miss_factor() const;
};

/// A test that finds objects window by window: the detector, or something trivial to compare it with.
class WindowTest {
 public:
  virtual ~WindowTest() = default;
  virtual void search(const Scene& scene) = 0;
  /// After search(): the factor on the threshold from which on the window passes for the object.
  virtual float factor(int window, size_t object) const = 0;
};

/// The colour stage of the first scale with the thresholds in force.
class ColourStageTest final : public WindowTest {
 public:
  explicit ColourStageTest(Detector& detector) : detector_(detector) {}
  void search(const Scene& scene) override;
  float factor(int window, size_t object) const override;
  /// Thread CPU time of each search, ms.
  const std::vector<double>& times_ms() const { return times_ms_; }

 private:
  Detector& detector_;
  std::vector<double> times_ms_;
};

/// Distance of the window's mean chromaticity (b, g, r) / (b + g + r) to that of the object's nearest view, background
/// left out. It has no threshold of its own: the factor is the distance.
class MeanColourTest final : public WindowTest {
 public:
  MeanColourTest(const SearchGrid& grid, std::span<const DatabaseObject> database);
  void search(const Scene& scene) override;
  float factor(int window, size_t object) const override;

 private:
  struct Chromaticity {
    double blue, green, red;
  };
  static Chromaticity mean(ImageView<const uint8_t> image, int x0, int y0, int side);
  SearchGrid grid_;
  std::vector<std::vector<Chromaticity>> objects_;
  std::vector<Chromaticity> windows_;
};

/// Searches one scene and adds what it shows.
void measure(const Scene& scene, const SearchGrid& grid, size_t objects, WindowTest& test, Measurement& measurement);

}  // namespace takt::object_detection
