// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/genetic_icp.hpp"

#include <doctest/doctest.h>

#include <stdexcept>

#include "nodes/laser_fusion/evaluate.hpp"
#include "nodes/laser_fusion/icp.hpp"
#include "rt/memory/memory_use.hpp"

using namespace takt;
using namespace takt::laser_fusion;

namespace {

constexpr PairParameters kFar{.points = 400, .offset_m = 0.8, .offset_rad = 0.8};

struct Search {
  CloudPair pair;
  Matcher matcher{400, 400, {}};
  GeneticIcp genetic;

  explicit Search(uint64_t seed, const GeneticParameters& p = {.generations = 3000})
      : pair(generate_pair(kFar, seed)), genetic(matcher, p) {
    matcher.set(pair.laser.points, pair.vision.points);
  }
};

bool same(const Rigid& a, const Rigid& b) { return a.R == b.R && a.t == b.t; }

const auto kAlways = [] { return true; };

}  // namespace

TEST_CASE("the best never gets worse, and is at most what plain ICP reaches from the same start") {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    Search search(seed);
    search.genetic.begin({}, seed);
    double before = search.genetic.quality().score;
    bool asked = false;
    while (!search.genetic.run([&] { return asked = !asked; })) {  // a portion at a time
      CHECK(search.genetic.quality().score <= before);
      before = search.genetic.quality().score;
    }
    CHECK(search.genetic.generation() == 3000);
    CHECK(search.genetic.quality().score <= icp(search.matcher, {}, {}).quality.score);
    CHECK(search.matcher.evaluate(search.genetic.best()).score == search.genetic.quality().score);
  }
}

TEST_CASE("the same seed gives the same answer, in one go or in many; another seed another way") {
  Search once(1), often(1);
  once.genetic.begin({}, 7);
  once.genetic.run(kAlways);
  for (int i = 0; i < 2; ++i) {  // nothing may be left over from the first time
    often.genetic.begin({}, 7);
    int jobs = 0;
    for (int left = 3; !often.genetic.run([&] { return --left > 0; }); left = 3) ++jobs;
    CHECK(jobs > 50);
    CHECK(same(often.genetic.best(), once.genetic.best()));
  }
  often.genetic.begin({}, 8);
  often.genetic.run(kAlways);
  CHECK_FALSE(same(often.genetic.best(), once.genetic.best()));
}

TEST_CASE("without time nothing is done, and the start pose is the answer") {
  Search search(1);
  const Rigid start = to_rigid({0.1, 0.2, 0.3, 0.1, 0.2, 0.3});
  search.genetic.begin(start, 1);
  CHECK_FALSE(search.genetic.run([] { return false; }));
  CHECK(search.genetic.generation() == 0);
  CHECK((search.genetic.best().R - start.R).norm() < 1e-12);
}

TEST_CASE("it finds the pose where plain ICP is lost") {
  const Success found =
      measure_success({.pair = {.points = 2000, .overlap = 0.9, .offset_m = 1.2, .offset_rad = 1.2},
                       .registration = {.points = 500, .cut_m = 0.25, .genetic = {.generations = 4000}},
                       .runs = 4});
  CHECK(found.runs == 4);
  CHECK(found.genetic >= 3);
  CHECK(found.plain <= 1);
  CHECK(found.score_at_found < 1.05 * found.score_at_truth);
}

TEST_CASE("more generations never leave a worse score, whatever the population") {
  const auto curves =
      measure_populations({.pair = kFar, .registration = {.cut_m = 0.25}, .runs = 2}, {2, 30}, {200, 1000});
  REQUIRE(curves.size() == 2);
  for (const PopulationCurve& curve : curves) CHECK(curve.score.at(1) <= curve.score.at(0));
}

TEST_CASE("locked parameters stay as in the start pose: a search in the plane") {
  GeneticParameters p{.generations = 2000};
  for (const Parameter locked : {kZ, kPitch, kRoll}) p.locks[locked] = true;
  Search search(3, p);
  const PoseParameters start{0, 0, 0.25, 0, 0.125, -0.5};
  search.genetic.begin(to_rigid(start), 1);
  search.genetic.run(kAlways);
  const PoseParameters found = to_parameters(search.genetic.best());
  for (const Parameter locked : {kZ, kPitch, kRoll}) CHECK(found[locked] == doctest::Approx(start[locked]));
  CHECK(std::abs(found[kYaw]) > 0.01);
}

TEST_CASE("clouds that never meet, and a population that is full all the time, do no harm") {
  Search search(2, {.population = 2, .generations = 500});
  search.genetic.begin(to_rigid({100, 0, 0, 0, 0, 0}), 1);
  CHECK(search.genetic.run(kAlways));
  search.genetic.begin({}, 1);
  CHECK(search.genetic.run(kAlways));
}

TEST_CASE("parameters that allow no search are refused") {
  Matcher matcher(10, 10, {});
  CHECK_THROWS_AS(GeneticIcp(matcher, {.population = 1}), std::invalid_argument);
  CHECK_THROWS_AS(GeneticIcp(matcher, {.locks = {true, true, true, true, true, true}}), std::invalid_argument);
}

TEST_CASE("a search allocates nothing") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  Search search(1, {.population = 20, .generations = 400});
  const uint64_t before = thread_memory_use().allocations;
  search.matcher.set(search.pair.laser.points, search.pair.vision.points);
  search.genetic.begin({}, 7);
  search.genetic.run(kAlways);
  CHECK(thread_memory_use().allocations == before);
}
