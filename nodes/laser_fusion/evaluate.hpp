// SPDX-License-Identifier: Apache-2.0
// How often a registration succeeds, on generated pairs. Runs go on all CPUs; what they give does not depend on how
// many.
#pragma once
#include <functional>
#include <vector>

#include "nodes/laser_fusion/generated_pair.hpp"
#include "nodes/laser_fusion/registration.hpp"

namespace takt::laser_fusion {

struct PoseError {
  double m = 0, rad = 0;
  bool success() const { return m <= 0.05 && rad <= 0.0349066; }  ///< 5 cm and 2 degrees
};
PoseError error_of(const Rigid& found, const Rigid& truth);

struct SuccessParameters {
  PairParameters pair{};
  RegistrationParameters registration{};
  uint64_t seed = 1;  ///< of the first pair; the others count on
  size_t runs = 20;
};

/// Of the runs with one overlap and one offset, all from the identity.
struct Success {
  size_t runs = 0;
  size_t genetic = 0, plain = 0, generalised = 0;  ///< successes; the two beside genetic ICP are refined as it is
  size_t deceived = 0;                  ///< failures of genetic ICP whose score is better than that of the true pose
  double median_m = 0, median_rad = 0;  ///< errors of genetic ICP
  double score_at_truth = 0, score_at_found = 0;  ///< medians, of the search
};
Success measure_success(const SuccessParameters& parameters);

/// The same with pairs of one's own: parameters.pair is not looked at. pair_of is called from several threads at once.
using PairSource = std::function<CloudPair(uint64_t seed)>;
Success measure_success(const SuccessParameters& parameters, const PairSource& pair_of);

/// Median score of the best pose after so many generations, over runs with one pair of clouds as it is, for one size of
/// the population (thesis Fig. 4.24).
struct PopulationCurve {
  size_t population = 0;
  std::vector<double> score;
};
std::vector<PopulationCurve> measure_populations(const SuccessParameters& parameters,
                                                 const std::vector<size_t>& populations,
                                                 const std::vector<uint32_t>& generations);

}  // namespace takt::laser_fusion
