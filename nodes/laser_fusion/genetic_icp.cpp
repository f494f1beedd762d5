// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/genetic_icp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "nodes/laser_fusion/icp.hpp"

namespace takt::laser_fusion {

bool all_locked(const Locks& locks) {
  return std::all_of(locks.begin(), locks.end(), [](bool locked) { return locked; });
}

GeneticIcp::GeneticIcp(PoseJudge& judge, const GeneticParameters& parameters) : judge_(&judge) {
  if (parameters.population < 2) throw std::invalid_argument("the population of genetic ICP must be at least 2");
  free_.reserve(parameters.locks.size());
  take(parameters);
  population_.reserve(parameters.population);
}

void GeneticIcp::take(const GeneticParameters& parameters) {
  if (all_locked(parameters.locks))
    throw std::invalid_argument("genetic ICP has nothing to vary: all six parameters are locked");
  parameters_ = parameters;
  free_.clear();
  for (const Parameter p : {kX, kY, kZ, kYaw, kPitch, kRoll})
    if (!parameters.locks[p]) free_.push_back(p);
}

void GeneticIcp::tune(GeneticParameters parameters) {
  parameters.population = parameters_.population;
  take(parameters);
}

void GeneticIcp::begin(const Rigid& start, uint64_t seed) {
  random_.seed(seed);
  start_ = best_ = to_parameters(start);
  generation_ = 0;
  begin_anew();
  quality_ = judge_->evaluate(to_rigid(current_));
  leader_ = scores_[0] = scores_[1] = quality_.score;
}

void GeneticIcp::begin_anew() {
  current_ = start_;
  population_.assign(1, start_);
  oldest_ = 0;
  last_gain_ = generation_;
}

void GeneticIcp::next() {
  const bool converged = generation_ >= 1 && !(std::abs(scores_[1] - scores_[0]) >= parameters_.eps_conv);
  if (converged && parameters_.patience > 0 && generation_ - last_gain_ >= parameters_.patience) {
    begin_anew();
    leader_ = std::numeric_limits<double>::infinity();
  }
  current_ = converged ? offspring() : icp_step(*judge_, current_, parameters_.locks);
  ++generation_;
  const Quality quality = judge_->evaluate(to_rigid(current_));
  scores_[1] = scores_[0];
  scores_[0] = quality.score;
  if (quality.score < quality_.score) quality_ = quality, best_ = current_;
  if (!(quality.score < leader_)) return;
  if (!(leader_ - quality.score < parameters_.eps_conv)) last_gain_ = generation_;
  leader_ = quality.score;
  if (population_.size() < parameters_.population) {
    population_.push_back(current_);
  } else {
    population_[oldest_] = current_;
    oldest_ = (oldest_ + 1) % population_.size();
  }
}

PoseParameters GeneticIcp::offspring() {
  PoseParameters child = population_[any(population_.size())];
  const PoseParameters& other = population_[any(population_.size())];
  const Parameter inherited = free_[any(free_.size())], mutated = free_[any(free_.size())];
  child[inherited] = other[inherited];
  child[mutated] += uniform(-parameters_.mutation[mutated], parameters_.mutation[mutated]);
  return child;
}

// Not the standard library's distributions, which differ from one to the next.
size_t GeneticIcp::any(size_t count) { return random_() % count; }

double GeneticIcp::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
}

}  // namespace takt::laser_fusion
