// SPDX-License-Identifier: Apache-2.0
// The file that `takt doctor --measure` leaves for `takt check`: what is read of it, and the only place that knows its
// keys. Pure; any thread.
#pragma once
#include <optional>
#include <string>

#include "hal/settings/json.hpp"
#include "rt/machine/identity.hpp"
#include "rt/sched/analysis/overheads.hpp"

namespace takt::graph {

/// What a check charges. Nothing: not measured.
struct MachineFigures {
  /// us, each in [0, 1e9).
  std::optional<double> release, context_switch, publish, take, per_mb, enforcement, demotion, look, tick;
  std::optional<double> deadline_bandwidth;  ///< cores, in [0, 1e6)
};

struct MeasuredMachine {
  machine::Identity machine;
  std::string measured_at;  ///< UTC; "": not known
  MachineFigures figures;
  MachineFigures worst;  ///< release, context_switch, publish and take: the largest sample
};

/// {"machine": {"cpu", "cores", "kernel"}, "measured_at", "release_us", "switch_us", "publish_us", "take_us",
/// "per_mb_us", "enforcement_us", "demotion_us", "look_us", "tick_us", "deadline_bandwidth", "worst": {the four that are
/// percentiles}}; a figure that was not measured is left out.
nlohmann::ordered_json measured_machine_json(const MeasuredMachine& measured);
/// The reverse; other keys are passed over, a figure that is missing or null was not measured. Throws std::exception
/// with what is wrong: no machine, a value of another type, a figure out of its range.
MeasuredMachine read_measured_machine(const nlohmann::json& file);

/// {"cpu", "cores", "kernel"}.
nlohmann::ordered_json identity_json(const machine::Identity& machine);

/// `otherwise`, with the figures that were measured in its place.
analysis::Overheads overheads_of(const MachineFigures& figures, analysis::Overheads otherwise);
/// The same with the worst figures, each `margin` of it larger; nothing unless all four are known.
std::optional<analysis::Overheads> worst_overheads(const MeasuredMachine& measured,
                                                   const analysis::Overheads& otherwise, double margin);
/// The overheads that are charged, under the keys of the file; and {"ordinary_ms", "ordinary_period_ms"}.
nlohmann::ordered_json overheads_json(const analysis::Overheads& overheads);

}  // namespace takt::graph
