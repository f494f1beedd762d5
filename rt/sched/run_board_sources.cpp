// SPDX-License-Identifier: Apache-2.0
// Sources that are lost and come back: what the board keeps of them, and the mode that follows from it.
#include <cstdio>

#include "rt/sched/run_board.hpp"

namespace takt {
namespace {

/// Losses leave room for what else may go wrong: a loose plug must not push a crash out of the log.
constexpr size_t kMostSourceFaults = kMostFaults - 16;

}  // namespace

void RunBoard::tell_source(size_t t, uint64_t job, const SourceReport& report, int64_t at_ns, int64_t from_ns) {
  SourceRecord& record = *sources_[t];
  record.tell(report);
  const SourceState before = record.state.load(std::memory_order_acquire);
  if (before == report.state) return follow_mode_rules(false, from_ns, "sources lost");
  note_source(t, job, report.state, at_ns);
  const bool newly_lost = before == SourceState::ok;
  if (!newly_lost && report.state != SourceState::ok) return;  // lost before, lost now
  char reason[120];
  std::snprintf(reason, sizeof reason, newly_lost ? "%s lost: %s" : "%s is back", task_names_[t].c_str(),
                to_text(report.state));
  follow_mode_rules(newly_lost, from_ns, reason);
}

void RunBoard::lose_sources(std::span<const size_t> tasks, int64_t at_ns, int64_t from_ns) {
  const SourceState dead = SourceState::unattended;
  const char* name = nullptr;
  for (const size_t t : tasks) {
    const SourceState before = sources_[t]->state.load(std::memory_order_acquire);
    if (!has_source_[t] || before == dead) continue;
    note_source(t, task(t).job_count.load(std::memory_order_acquire), dead, at_ns);
    if (before == SourceState::ok) name = task_names_[t].c_str();
  }
  if (name == nullptr) return;
  char reason[120];
  std::snprintf(reason, sizeof reason, "%s lost: %s", name, to_text(dead));
  follow_mode_rules(true, from_ns, reason);
}

void RunBoard::note_source(size_t t, uint64_t job, SourceState state, int64_t at_ns) {
  SourceRecord& record = *sources_[t];
  const SourceState before = record.state.load(std::memory_order_relaxed);
  const bool lost = before == SourceState::ok, back = state == SourceState::ok;
  if (lost) {
    record.losses.fetch_add(1, std::memory_order_relaxed);
    record.lost_since_ns.store(at_ns, std::memory_order_relaxed);
  }
  const int64_t gone_ns = at_ns - record.lost_since_ns.load(std::memory_order_relaxed);
  if (back) record.lost_ns.fetch_add(gone_ns, std::memory_order_relaxed);
  record.since_ns.store(at_ns, std::memory_order_relaxed);
  record.state.store(state, std::memory_order_release);
  if ((!lost && !back) || faults().size() >= kMostSourceFaults) return;
  Fault fault;
  fault.kind = lost ? Fault::lost : Fault::back;
  fault.task = static_cast<uint32_t>(t);
  fault.job = job;
  fault.at_ns = at_ns;
  auto& what = fault.what.characters;
  if (lost) std::snprintf(what.data(), what.size(), "%s lost: %s", task_names_[t].c_str(), to_text(state));
  else
    std::snprintf(what.data(), what.size(), "%s is back after %lld ms", task_names_[t].c_str(),
                  static_cast<long long>(gone_ns / 1'000'000));
  faults().append(fault);
}

SourceSet RunBoard::lost_sources() const {
  SourceSet lost = 0;
  for (size_t i = 0; i < mode_rules_.sources.size(); ++i)
    if (sources_[mode_rules_.sources[i]]->state.load(std::memory_order_acquire) != SourceState::ok)
      lost |= SourceSet{1} << i;
  return lost;
}

void RunBoard::follow_mode_rules(bool newly_lost, int64_t from_ns, const char* reason) {
  if (mode_rules_.rules.empty() || safe_stop_mode_ == kNone) return;
  const auto wanted = change_of_mode(mode_rules_, lost_sources(), newly_lost, modes().in_force(), safe_stop_mode_);
  if (!wanted) return;
  // No room for more changes: the robot must not be left in a mode that counts on what is lost.
  if (!modes().request_by_rule(static_cast<uint32_t>(*wanted), from_ns, reason))
    safe_stop(from_ns, "too many changes of mode");
}

}  // namespace takt
