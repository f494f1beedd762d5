// SPDX-License-Identifier: Apache-2.0
// The operations of this room one after the other, in place, in memory taken once.
#pragma once
#include <optional>
#include <string_view>
#include <utility>

#include "nodes/cloud/outlier_filter.hpp"
#include "nodes/cloud/voxel_operations.hpp"

namespace takt::cloud {

/// In the order in which they are done: wrong points first, so that no later step spreads them; gaps before smoothing,
/// which is for a cloud of even density; reduction last, since it only sets the resolution.
enum class Step : uint8_t { outliers, interpolate, smooth, reduce };
std::string_view to_string(Step step);

/// Which steps are done, and how. A radius or an edge of 0 leaves the step out.
struct FilterSteps {
  OutlierParameters outliers{0, 100};
  size_t n_min_points = 0;  ///< n_min holds for a cloud of so many points and is scaled to others; 0: it is not scaled
  InterpolateParameters interpolate{.edge_m = 0};
  SmoothParameters smooth{.edge_m = 0};
  double reduce_edge_m = 0;
};

/// What a step left behind.
struct StepResult {
  Step step;
  size_t points;    ///< that there are afterwards
  size_t unusable;  ///< points that it could not place: not finite, or too far away
};

class CloudFilter {
 public:
  /// Takes the memory for clouds of up to `capacity` points: what the steps need, 26 B a point for outliers and 85 for
  /// the others together. run() allocates nothing. Throws std::invalid_argument as VoxelGrid does.
  CloudFilter(size_t capacity, const FilterSteps& steps);
  /// From the next run() on. Throws std::invalid_argument if a step is wanted that memory was not taken for.
  void tune(const FilterSteps& steps);

  /// Calls told(const StepResult&) after each step. A step that makes points may fill the buffer: what it lost stands
  /// there. cloud.capacity() is at most that of the filter.
  template <class Told>
  void run(CloudBuffer& cloud, const Told& told) {
    for (const Step step : {Step::outliers, Step::interpolate, Step::smooth, Step::reduce})
      if (wants(step)) {
        const size_t unusable = run(step, cloud);
        told(StepResult{step, cloud.size(), unusable});
      }
  }

 private:
  static bool wants(const FilterSteps& steps, Step step);
  bool wants(Step step) const { return wants(steps_, step); }
  /// Returns how many points were unusable.
  size_t run(Step step, CloudBuffer& cloud);

  FilterSteps steps_;
  std::optional<OutlierFilter> outliers_;
  std::vector<uint8_t> keep_;
  std::optional<VoxelGrid> grid_;
};

}  // namespace takt::cloud
