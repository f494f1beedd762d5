// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/chain_age.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "rt/sched/analysis/integers.hpp"

namespace takt::analysis {
namespace {

/// Jobs of the last task within one common period of all, if that is small enough to look at each.
std::optional<Ticks> jobs_to_try(const std::vector<ChainTask>& chain) {
  constexpr Ticks kMost = 100'000;
  const Ticks own = chain.back().period;
  Wide common = own;
  for (const ChainTask& task : chain) {
    if (!task.phased) return std::nullopt;
    common = common / std::gcd(static_cast<Ticks>(common), task.period) * task.period;
    if (common / own > kMost || common > kLongest) return std::nullopt;
  }
  return static_cast<Ticks>(common) / own;
}

/// Release of the device's job whose data a job of the last task holds that is released at `release`.
Ticks origin(const std::vector<ChainTask>& chain, Ticks release) {
  for (size_t i = chain.size() - 1; i > 0; --i) {
    if (chain[i].follows) continue;
    const ChainTask& producer = chain[i - 1];
    const Ticks newest = floor_div(release - producer.visible - producer.offset, producer.period);
    release = producer.offset + newest * producer.period;
  }
  return release;
}

/// Longest time from the release of a job to the one that takes its message, edge by edge.
Ticks longest_wait(const ChainTask& producer, const ChainTask& consumer) {
  if (consumer.follows) return 0;
  if (!producer.phased || !consumer.phased) return producer.period + producer.visible;
  // The instants at which messages become visible and those of the releases repeat with this step against each other.
  const Ticks step = std::gcd(producer.period, consumer.period);
  return producer.visible + producer.period - step +
         floor_mod(consumer.offset - producer.offset - producer.visible, step);
}

}  // namespace

ChainAge chain_age(const std::vector<ChainTask>& chain) {
  Ticks age = 0, older = 0;
  for (size_t i = 1; i < chain.size(); ++i)
    if (!chain[i].follows) older += (static_cast<Ticks>(chain[i].depth) - 1) * chain[i - 1].period;
  if (const auto jobs = jobs_to_try(chain)) {
    for (Ticks k = 0; k < *jobs; ++k) {
      const Ticks release = chain.back().offset + k * chain.back().period;
      age = std::max(age, release - origin(chain, release));
    }
  } else {
    for (size_t i = 1; i < chain.size(); ++i) age += longest_wait(chain[i - 1], chain[i]);
  }
  age += chain.back().visible;
  return {age, age + older};
}

Ticks least_chain_age(std::vector<ChainTask> chain) {
  // Without known phases the best one counts.
  for (ChainTask& task : chain) {
    task.visible = 0;
    if (!task.phased) return 0;
  }
  return chain_age(chain).newest;
}

}  // namespace takt::analysis
