// SPDX-License-Identifier: Apache-2.0
// ICP that leaves local minima by reproduction and mutation (thesis Alg. 4.3, repaired: E-29). Whenever ICP converges,
// a pose of the population takes one parameter of another and has one changed at random; ICP goes on from there. What
// beats all before joins the population. A population that gets no better may sit in a wrong place for good: with some
// patience, another one begins where the first did (not in the thesis).
#pragma once
#include <cstdint>
#include <random>
#include <vector>

#include "nodes/laser_fusion/pose_judge.hpp"
#include "rt/state_archive.hpp"

namespace takt::laser_fusion {

struct GeneticParameters {
  size_t population = 100;                                   ///< at most; 2 and more, 50 to 200 advised
  uint32_t generations = 25'000;                             ///< ICP steps
  PoseParameters mutation{0.5, 0.5, 0.5, 1.05, 1.05, 1.05};  ///< a parameter changes by at most so much, m and rad
  double eps_conv = 1e-5;                                    ///< a local minimum: the score changed by less
  Locks locks{};                                             ///< these parameters stay as in the start pose
  uint32_t patience = 0;  ///< after so many generations without a gain it begins anew, the best so far kept; 0: never
};

bool all_locked(const Locks& locks);

class GeneticIcp {
 public:
  /// Takes its memory. Throws std::invalid_argument if all parameters are locked, or the population is below 2.
  GeneticIcp(PoseJudge& judge, const GeneticParameters& parameters);

  /// From the next begin() on; the population stays as it was. Throws std::invalid_argument as the constructor does.
  void tune(GeneticParameters parameters);
  /// Begins anew with the clouds that the judge has. The same seed gives the same answer.
  void begin(const Rigid& start, uint64_t seed);

  /// Generations, until all are done or `more` says no: it is asked before each portion. Returns done().
  template <class More>
  bool run(const More& more) {
    while (!done() && more()) go_on();
    return done();
  }
  /// One portion of kPortion generations; returns done().
  bool go_on() {
    for (uint32_t i = 0; i < kPortion && !done(); ++i) next();
    return done();
  }

  bool done() const { return generation_ >= parameters_.generations; }
  uint32_t generation() const { return generation_; }
  Rigid best() const { return to_rigid(best_); }
  const Quality& quality() const { return quality_; }  ///< of the best; never worse than before
  /// For the clouds that the judge has.
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, random_, population_, oldest_, start_, current_, best_, quality_, leader_, last_gain_, scores_,
               generation_);
    if (!archive.loads() || archive.failed() || population_.empty()) return;
    if (population_.size() > parameters_.population || oldest_ >= population_.size()) archive.fail();
    else judge_->evaluate(to_rigid(current_));  // its pairs are those of the present pose
  }
  void room(StateArchive& archive) const {
    archive.room(sizeof *this + population_.capacity() * sizeof(PoseParameters));
  }

  /// Some tenths of a millisecond with 1000 + 1000 points.
  static constexpr uint32_t kPortion = 8;

 private:
  /// Throws std::invalid_argument.
  void take(const GeneticParameters& parameters);
  void next();
  void begin_anew();
  PoseParameters offspring();
  size_t any(size_t count);
  double uniform(double low, double high);

  PoseJudge* judge_;
  GeneticParameters parameters_;
  std::vector<Parameter> free_;  ///< not locked
  std::mt19937_64 random_;
  std::vector<PoseParameters> population_;  ///< a ring, once it is full
  size_t oldest_ = 0;
  PoseParameters start_{}, current_{}, best_{};
  Quality quality_{};
  double leader_ = 0;       ///< best score since it began, or began anew
  uint32_t last_gain_ = 0;  ///< generation
  double scores_[2] = {};   ///< of the current pose and of the one before
  uint32_t generation_ = 0;
};

}  // namespace takt::laser_fusion
