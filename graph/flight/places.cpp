// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "rt/record/ring.hpp"
#include "rt/sched/plan_ports.hpp"

namespace takt::flight {
namespace {

using record::PortRule;

/// A task that has a job as seldom as this has a snapshot in each file.
constexpr int64_t kSlowest_ns = 1'000'000'000;
/// As long may it take until a window has been copied out of memory.
constexpr int64_t kWritten_ns = 2'000'000'000;

/// A large state is kept on disk as seldom as makes this of it, and each file of a minute has one.
constexpr double kStatesOnDisk = 0.25e6;
constexpr int64_t kMostSeldom_ns = 60'000'000'000;

/// Messages of a port that are kept with all fields, a second.
double kept_hz(const PortRule& rule, double rate_hz) {
  if (rule.keep != PortRule::all) return 0;
  const double hz = rate_hz / rule.every;
  return rule.pause_ns > 0 ? std::min(hz, 1e9 / static_cast<double>(rule.pause_ns)) : hz;
}

/// What a node remembers, where it is too much to be kept each time.
PortRule rule_of_state(double bytes) {
  const auto pause_ns = std::min(kMostSeldom_ns, static_cast<int64_t>(1e9 * bytes / kStatesOnDisk));
  return 1e9 * bytes / static_cast<double>(pause_ns) > kMostOnDisk ? PortRule{PortRule::hash}
                                                                   : PortRule{PortRule::all, 1, pause_ns};
}

}  // namespace

bool Places::in_memory() const {
  return std::any_of(memory.begin(), memory.end(), [](const PortRule& rule) { return rule.keep == PortRule::all; });
}

const PortRule* rule_of(const graph::RecordSpec& spec, const PortPlan& port) {
  for (const graph::RecordSpec::Port& given : spec.ports)
    if (given.port.node == port.node && given.port.port == port.port) return &given.rule;
  return nullptr;
}

Places places(const graph::RecordSpec& spec, const Plan& plan) {
  Places places;
  places.disk.resize(plan.ports.size());
  places.memory.assign(plan.ports.size(), {PortRule::nothing});
  const PortProducers producers(plan);
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    const PortPlan& port = plan.ports[p];
    PortRule& rule = places.disk[p];
    const PortRule* asked = rule_of(spec, port);
    if (asked != nullptr) rule = *asked;
    places.memory[p].jpeg = rule.jpeg;  // both parts of a ring are of one format, and can be joined
    const size_t task = producers.find(p);
    const bool state = task != kNone && is_state_port(plan.tasks[task], p);
    const double rate_hz = task == kNone ? 0 : messages_s(plan, p);
    const double bytes_s = kept_hz(rule, rate_hz) * static_cast<double>(port.chunk_bytes());
    if (bytes_s <= kMostOnDisk) {
      places.disk_bytes_s += bytes_s;
      continue;
    }
    // A replay makes again what a node made of what devices gave it.
    if (asked != nullptr || state || task == kNone || plan.tasks[task].device || spec.state_every_ns() == 0) {
      places.memory_bytes_s += bytes_s;
      places.memory[p] = rule;
    }
    if (asked != nullptr || !state) {
      rule.keep = PortRule::hash;
      continue;
    }
    rule = rule_of_state(static_cast<double>(port.chunk_bytes()));
    places.disk_bytes_s += kept_hz(rule, rate_hz) * static_cast<double>(port.chunk_bytes());
    places.states_ns = std::max(places.states_ns, rule.pause_ns);
  }
  return places;
}

int64_t lead_ns(const graph::RecordSpec& spec) {
  return spec.state_every_ns() > 0 ? 2 * spec.state_every_ns() + kSlowest_ns : 0;
}

int64_t memory_to_use(const graph::RecordSpec& spec) {
  std::error_code error;
  const auto space = std::filesystem::space("/dev/shm", error);
  const int64_t most = error ? 0 : static_cast<int64_t>(space.available / 2);
  const int64_t used = std::min(spec.memory_bytes, most);
  return used >= static_cast<int64_t>(record::RingLimits::kLeastBytes) ? used : 0;
}

std::vector<std::string> doubts(const graph::RecordSpec& spec, const Places& places,
                                const std::filesystem::path& folder) {
  std::vector<std::string> doubts;
  const double window_s = static_cast<double>(lead_ns(spec) + spec.before_ns + 2 * spec.after_ns + kWritten_ns) / 1e9;
  const auto room = [&](const std::filesystem::path& place, int64_t wanted) {
    std::error_code error;
    const auto space = std::filesystem::space(place, error);
    if (!error && space.available < static_cast<uint64_t>(wanted))
      doubts.push_back(fmt::format("record: {} has {:.0f} MB left, less than the {:.0f} MB that the ring may take",
                                   place.string(), static_cast<double>(space.available) / 1e6,
                                   static_cast<double>(wanted) / 1e6));
  };
  room(folder, spec.disk_bytes);
  if (!places.in_memory()) return doubts;
  const int64_t memory = memory_to_use(spec);
  if (memory < spec.memory_bytes)
    doubts.push_back(
        fmt::format("record: {:.0f} MB of /dev/shm are used instead of `memory` {:.0f} MB: half of what is free",
                    static_cast<double>(memory) / 1e6, static_cast<double>(spec.memory_bytes) / 1e6));
  const double held_s = static_cast<double>(memory) / places.memory_bytes_s;
  if (held_s < window_s)
    doubts.push_back(
        fmt::format("record: {:.0f} MB of memory may hold {:.1f} s of images and clouds ({:.1f} MB/s), less than the "
                    "{:.1f} s of a frozen file with its snapshots",
                    static_cast<double>(memory) / 1e6, held_s, places.memory_bytes_s / 1e6, window_s));
  return doubts;
}

std::string ring_text(const graph::RecordSpec& spec, const Plan& plan, const std::filesystem::path& folder) {
  const Places kept = places(spec, plan);
  const auto mb = [](auto bytes) { return static_cast<double>(bytes) / 1e6; };
  std::string text = fmt::format("ring: at most {:.0f} MB of disk, for {:.2f} MB/s of small messages beside the jobs",
                                 mb(spec.disk_bytes), mb(kept.disk_bytes_s));
  if (kept.in_memory())
    text +=
        fmt::format("; {:.0f} MB of memory, for {:.1f} MB/s of images and clouds: {:.1f} s", mb(memory_to_use(spec)),
                    mb(kept.memory_bytes_s), static_cast<double>(memory_to_use(spec)) / kept.memory_bytes_s);
  text += "\n";
  for (const std::string& doubt : doubts(spec, kept, folder)) text += "note: " + doubt + "\n";
  return text;
}

nlohmann::ordered_json ring_json(const graph::RecordSpec& spec, const Plan& plan, const std::filesystem::path& folder) {
  const Places kept = places(spec, plan);
  return {{"disk_mb", static_cast<double>(spec.disk_bytes) / 1e6},
          {"disk_mb_s", kept.disk_bytes_s / 1e6},
          {"memory_mb", static_cast<double>(memory_to_use(spec)) / 1e6},
          {"memory_mb_s", kept.memory_bytes_s / 1e6},
          {"doubts", doubts(spec, kept, folder)}};
}

}  // namespace takt::flight
