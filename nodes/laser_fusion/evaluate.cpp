// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/evaluate.hpp"

#include <opencv2/core/utility.hpp>

#include "rt/quantile.hpp"

namespace takt::laser_fusion {
namespace {

/// Calls body(0) .. body(count - 1) on all CPUs, in any order.
template <typename Body>
void for_each(size_t count, const Body& body) {
  cv::parallel_for_(
      {0, static_cast<int>(count)},
      [&](const cv::Range& range) {
        for (int i = range.start; i < range.end; ++i) body(static_cast<size_t>(i));
      },
      static_cast<double>(count));
}

/// One pair from the same start by three methods, all refined alike.
struct Registrations {
  PoseError genetic, plain, generalised;
  double score_at_truth = 0, score_at_found = 0;  ///< of the search
};

Registrations register_once(const CloudPair& pair, const RegistrationParameters& parameters) {
  Registration registration(pair.laser.view(), pair.vision.view(), parameters);
  const auto refined_error = [&](const Rigid& pose) {
    return error_of(registration.refined(pose), pair.vision_in_laser);
  };
  const Rigid found = registration.search({});
  return {.genetic = refined_error(found),
          .plain = refined_error(registration.plain({})),
          .generalised = refined_error(registration.generalised({})),
          .score_at_truth = registration.judged(pair.vision_in_laser).score,
          .score_at_found = registration.judged(found).score};
}

}  // namespace

PoseError error_of(const Rigid& found, const Rigid& truth) {
  return {(found.t - truth.t).norm(), ego_motion::rotation_vector(found.R.transpose() * truth.R).norm()};
}

Success measure_success(const SuccessParameters& p) {
  return measure_success(p, [&](uint64_t seed) { return generate_pair(p.pair, seed); });
}

Success measure_success(const SuccessParameters& p, const PairSource& pair_of) {
  std::vector<Registrations> runs(p.runs);
  for_each(runs.size(), [&](size_t run) {
    RegistrationParameters parameters = p.registration;
    parameters.seed = p.seed + run;
    runs[run] = register_once(pair_of(parameters.seed), parameters);
  });
  Success out;
  std::vector<double> error_m, error_rad, at_truth, at_found;
  for (const Registrations& run : runs) {
    ++out.runs;
    out.genetic += run.genetic.success();
    out.plain += run.plain.success();
    out.generalised += run.generalised.success();
    out.deceived += !run.genetic.success() && run.score_at_found < run.score_at_truth;
    error_m.push_back(run.genetic.m);
    error_rad.push_back(run.genetic.rad);
    at_truth.push_back(run.score_at_truth);
    at_found.push_back(run.score_at_found);
  }
  out.median_m = median(error_m);
  out.median_rad = median(error_rad);
  out.score_at_truth = median(at_truth);
  out.score_at_found = median(at_found);
  return out;
}

std::vector<PopulationCurve> measure_populations(const SuccessParameters& p, const std::vector<size_t>& populations,
                                                 const std::vector<uint32_t>& generations) {
  const CloudPair pair = generate_pair(p.pair, p.seed);
  // scores[population][generations][run]
  std::vector scores(populations.size(), std::vector(generations.size(), std::vector<double>(p.runs)));
  for_each(populations.size() * p.runs, [&](size_t task) {
    const size_t population = task / p.runs, run = task % p.runs;
    Matcher matcher(p.pair.points, p.pair.points, {.metric = p.registration.metric, .cut_m = p.registration.cut_m});
    matcher.set(pair.laser.points, pair.vision.points);
    GeneticParameters parameters = p.registration.genetic;
    parameters.population = populations[population];
    parameters.generations = generations.back();
    GeneticIcp genetic(matcher, parameters);
    genetic.begin({}, p.seed + run);
    for (size_t g = 0; g < generations.size(); ++g) {
      genetic.run([&] { return genetic.generation() < generations[g]; });
      scores[population][g][run] = genetic.quality().score;
    }
  });
  std::vector<PopulationCurve> curves;
  for (size_t i = 0; i < populations.size(); ++i) {
    curves.push_back({populations[i], {}});
    for (auto& runs : scores[i]) curves.back().score.push_back(median(std::move(runs)));
  }
  return curves;
}

}  // namespace takt::laser_fusion
