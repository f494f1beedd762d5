// SPDX-License-Identifier: Apache-2.0
// Internal: loops over all observations. Observation i goes to accumulator i mod kLanes, and these are added up in a
// fixed order, so that every SIMD target gives the same bits.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "nodes/ego_motion/motion.hpp"

namespace takt::ego_motion {

/// Observations, a column for each quantity.
class ObservationTable {
 public:
  static constexpr size_t kLanes = 8;

  /// For at most `capacity` observations; nothing allocates afterwards.
  explicit ObservationTable(size_t capacity = 0);
  void fill(std::span<const Observation> observations, const Optics& optics);
  size_t size() const { return size_; }
  const Optics& optics() const { return optics_; }

  enum Column { x, y, z, u, v, d, has_d, columns };  ///< point seen before (m); where it is seen now (px); 0 or 1
  const double* operator[](Column column) const { return values_.data() + column * stride_; }

 private:
  size_t size_ = 0, stride_ = 0;
  Optics optics_;
  std::vector<double> values_;
};

/// How observations count in the normal equations: `use` 0 or 1 each, times the Cauchy weight 1 / (1 + r^2 / scale^2)
/// unless scale is 0.
struct Weights {
  const double* use;
  double scale_px;
};

/// Upper triangle of a 6 x 6 matrix, row after row.
using Triangle = std::array<double, 21>;

struct NormalEquations {
  Triangle matrix;               ///< sum of w J^T J
  std::array<double, 6> vector;  ///< sum of w J^T r
};

/// How uncertain the vector of the normal equations is.
struct Scatter {
  Triangle matrix;                              ///< sum of g g^T, g = w J^T r of one observation
  std::array<std::array<double, 6>, 3> shared;  ///< sum of w J^T of the residuals in x, y and d: by an error of 1 px
                                                ///< that all observations have
};

/// Squares of the residuals, each at most the limit's, and how many lie below it.
struct Score {
  double cost = 0;
  size_t inside = 0;
};

/// Rotation (row-major) and translation.
using Motion12 = std::array<double, 12>;
Motion12 to_array(const Rigid& motion);

struct MotionKernels {
  Score (*score)(const ObservationTable& table, const Motion12& T, double limit_px);
  /// use[i] = 1 if the residual lies below the limit, else 0; for i up to the next multiple of kLanes.
  void (*mark)(const ObservationTable& table, const Motion12& T, double limit_px, double* use);
  NormalEquations (*normal)(const ObservationTable& table, const Motion12& T, const Weights& weights);
  Scatter (*scatter)(const ObservationTable& table, const Motion12& T, const Weights& weights);
};

const MotionKernels& motion_kernels();     ///< of the best SIMD target of this machine
const MotionKernels& motion_references();  ///< slow and obvious: one observation after the other; the same bits

/// Adds up the accumulators: 4 apart, 2, 1.
inline double sum_of_lanes(const double* lanes) {
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
}

}  // namespace takt::ego_motion
