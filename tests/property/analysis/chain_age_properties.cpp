// SPDX-License-Identifier: Apache-2.0
// The bound on the age at the end of a chain against a run of the latch rule, job by job, with adversarial phases and
// responses: never exceeded, and reached within a factor.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>

#include "random.hpp"
#include "rt/sched/analysis/chain_age.hpp"
#include "tests/property_scale.hpp"

using namespace takt::analysis;

namespace {

struct Message {
  Ticks release, visible_at, origin;
};

enum class Responses { longest, shortest, random, first_half };

/// The latch rule as it is written: each task in turn, every job of it, each taking the newest message that is visible.
/// Unphased tasks start anywhere. Returns the greatest age at the end, after all tasks have had data.
Ticks observed_age(const std::vector<ChainTask>& chain, Responses how, Random& random) {
  Ticks span = 0;
  for (const ChainTask& task : chain) span += 8 * task.period + task.offset + task.visible;
  std::vector<Message> input, output;
  Ticks worst = 0, start = 0;
  for (size_t i = 0; i < chain.size(); ++i) {
    const ChainTask& task = chain[i];
    if (!task.follows) start = task.phased ? task.offset : random.uniform(0, task.period);  // else that of its lane
    output.clear();
    for (Ticks k = 0; start + k * task.period < span; ++k) {
      const Ticks release = start + k * task.period;
      const Ticks least = task.follows ? chain[i - 1].visible : 0;
      const Ticks response = how == Responses::longest      ? task.visible
                             : how == Responses::shortest   ? least
                             : how == Responses::first_half ? (k % 2 == 0 ? task.visible : least)
                                                            : random.uniform(least, task.visible);
      Ticks origin = release;
      if (i > 0) {
        const Message* newest = nullptr;
        for (const Message& m : input) {
          const bool taken = task.follows ? m.release == release : m.visible_at <= release;
          if (taken && (newest == nullptr || m.origin >= newest->origin)) newest = &m;
        }
        if (newest == nullptr) continue;
        origin = newest->origin;
      }
      output.push_back({release, release + response, origin});
      if (i + 1 == chain.size()) worst = std::max(worst, release + response - origin);
    }
    input = output;
  }
  return worst;
}

std::vector<ChainTask> random_chain(Random& random, bool phased) {
  std::vector<ChainTask> chain;
  const Ticks length = random.uniform(2, 5);
  for (Ticks i = 0; i < length; ++i) {
    ChainTask task;
    task.period = random.uniform(1, 12) * random.uniform(1, 4);
    task.offset = random.uniform(0, task.period);
    task.visible = random.uniform(1, task.period);
    task.phased = phased;
    if (i > 0 && random.uniform(0, 3) == 0) {  // in the lane of the one before, by each of its messages or every other
      task.follows = true;
      task.period = chain.back().period * random.uniform(1, 2);
      task.offset = chain.back().offset;
      task.visible += chain.back().visible;
    }
    task.depth = static_cast<uint32_t>(random.uniform(1, 3));
    chain.push_back(task);
  }
  return chain;
}

}  // namespace

TEST_CASE("chain age: the bound is never exceeded, with known phases it is reached within a factor") {
  Random random{std::mt19937(takt::test::seed(30))};
  double ratio = 0;
  for (int round = 0; round < takt::test::rounds(3'000); ++round) {
    CAPTURE(round);
    const std::vector<ChainTask> chain = random_chain(random, true);
    const Ticks bound = chain_age(chain).newest;
    Ticks seen = 0;
    for (const Responses how : {Responses::longest, Responses::shortest, Responses::random, Responses::first_half})
      seen = std::max(seen, observed_age(chain, how, random));
    REQUIRE(seen <= bound);
    REQUIRE(least_chain_age(chain) <= bound);
    ratio = std::max(ratio, static_cast<double>(bound) / static_cast<double>(seen));
  }
  std::printf("chain age, phases known: largest bound / observed %.3f\n", ratio);
  CHECK(ratio <= 3);
}

TEST_CASE("chain age: without known phases the bound is never exceeded, whatever they are, and not far off") {
  Random random{std::mt19937(takt::test::seed(31))};
  double largest = 0, sum = 0;
  const int rounds = takt::test::rounds(400);
  for (int round = 0; round < rounds; ++round) {
    CAPTURE(round);
    const std::vector<ChainTask> chain = random_chain(random, false);
    const Ticks bound = chain_age(chain).newest;
    Ticks seen = 0;
    for (int phase = 0; phase < 60; ++phase)
      for (const Responses how : {Responses::longest, Responses::random})
        seen = std::max(seen, observed_age(chain, how, random));
    REQUIRE(seen <= bound);
    const double ratio = static_cast<double>(bound) / static_cast<double>(seen);
    largest = std::max(largest, ratio);
    sum += ratio;
  }
  std::printf("chain age, phases unknown: bound / observed %.3f on average, at most %.3f\n", sum / rounds, largest);
  CHECK(largest <= 3);
}

TEST_CASE("chain age: figures that can be found by hand") {
  ChainTask camera{10, 0, true, 2}, stereo{10, 3, true, 6}, map{20, 8, true, 5};
  // Taken at 3, done at 9; the next map is released at 28: it sees the image of 10, and is done at 33.
  CHECK(chain_age({camera, stereo}).newest == 3 + 6);
  CHECK(chain_age({camera, stereo, map}).newest == 18 + 5);
  // One tick later than the offset it is the image before.
  camera.visible = 4;
  CHECK(chain_age({camera, stereo}).newest == 13 + 6);
  // A follower takes the very message, whatever the phases.
  stereo.follows = true;
  stereo.offset = 0;
  CHECK(chain_age({camera, stereo}).newest == 6);
  // Nobody knows the phase: a period and a bound more.
  stereo.follows = stereo.phased = false;
  CHECK(chain_age({camera, stereo}).newest == 10 + 4 + 6);
  stereo.depth = 3;
  CHECK(chain_age({camera, stereo}).oldest == 10 + 4 + 6 + 2 * 10);
  CHECK(least_chain_age({{10, 0}, {10, 3}, {20, 8}}) == 8);
}
