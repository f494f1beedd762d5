// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/evaluate.hpp"

#include <algorithm>

namespace takt::laser_fusion {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

PoseError error_of(const Rigid& found, const Rigid& truth) {
  return {(found.t - truth.t).norm(), ego_motion::rotation_vector(found.R.transpose() * truth.R).norm()};
}

Success measure_success(const SuccessParameters& p) {
  return measure_success(p, [&](uint64_t seed) { return generate_pair(p.pair, seed); });
}

Success measure_success(const SuccessParameters& p, const PairSource& pair_of) {
  Success out;
  std::vector<double> error_m, error_rad, at_truth, at_found;
  for (; out.runs < p.runs; ++out.runs) {
    RegistrationParameters parameters = p.registration;
    parameters.seed = p.seed + out.runs;
    const CloudPair pair = pair_of(parameters.seed);
    Registration registration(pair.laser.view(), pair.vision.view(), parameters);
    const Rigid found = registration.search({});
    const PoseError error = error_of(registration.refined(found), pair.vision_in_laser);
    at_found.push_back(registration.judged(found).score);
    at_truth.push_back(registration.judged(pair.vision_in_laser).score);
    error_m.push_back(error.m);
    error_rad.push_back(error.rad);
    out.genetic += error.success();
    out.deceived += !error.success() && at_found.back() < at_truth.back();
    const auto succeeds = [&](const Rigid& pose) {
      return error_of(registration.refined(pose), pair.vision_in_laser).success();
    };
    out.plain += succeeds(registration.plain({}));
    out.generalised += succeeds(registration.generalised({}));
  }
  out.median_m = median(error_m);
  out.median_rad = median(error_rad);
  out.score_at_truth = median(at_truth);
  out.score_at_found = median(at_found);
  return out;
}

std::vector<PopulationCurve> measure_populations(const SuccessParameters& p, const std::vector<size_t>& populations,
                                                 const std::vector<uint32_t>& generations) {
  std::vector<PopulationCurve> curves;
  Matcher matcher(p.pair.points, p.pair.points, {.metric = p.registration.metric, .cut_m = p.registration.cut_m});
  const CloudPair pair = generate_pair(p.pair, p.seed);
  matcher.set(pair.laser.points, pair.vision.points);
  for (const size_t population : populations) {
    GeneticParameters parameters = p.registration.genetic;
    parameters.population = population;
    parameters.generations = generations.back();
    GeneticIcp genetic(matcher, parameters);
    std::vector<std::vector<double>> scores(generations.size());
    for (size_t run = 0; run < p.runs; ++run) {
      genetic.begin({}, p.seed + run);
      for (size_t g = 0; g < generations.size(); ++g) {
        genetic.run([&] { return genetic.generation() < generations[g]; });
        scores[g].push_back(genetic.quality().score);
      }
    }
    curves.push_back({population, {}});
    for (auto& s : scores) curves.back().score.push_back(median(std::move(s)));
  }
  return curves;
}

}  // namespace takt::laser_fusion
