// SPDX-License-Identifier: Apache-2.0
// What `takt doctor --measure` leaves for `takt check`: the figures of this machine, as a file of the user.
#pragma once
#include <filesystem>
#include <string>

#include "hal/settings/json.hpp"
#include "rt/machine/identity.hpp"
#include "rt/machine/measure.hpp"

namespace takt::graph {

/// $TAKT_MACHINE, else $XDG_CACHE_HOME/takt/machine.json, else ~/.cache/takt/machine.json; an unset or empty variable
/// is passed over. Empty if none of them is set.
std::filesystem::path figures_file(const char* takt_machine, const char* cache_home, const char* home);
/// The same from the environment of this process.
std::filesystem::path figures_file();

/// graph::measured_machine_json(), which `takt check` reads, with "policy" (the one that `release_us` was measured
/// under) and "details": medians, tails and samples. Charged are the 99th percentiles of release, switch, publish and
/// take (of 128 bytes, the dearer of the transports measured; the largest where samples are too few for one); per_mb_us
/// is what publish and take together grow by with each megabyte, enforcement_us the largest overrun seen of a
/// SCHED_DEADLINE reservation. A key is absent where these rights did not allow to measure it.
nlohmann::ordered_json measured_json(const machine::Identity& machine, const std::string& measured_at,
                                     const machine::Measured& measured);
/// The same for people.
std::string measured_text(const machine::Measured& measured);

/// Makes the folder of the file; "" or why the file cannot be written there.
std::string cannot_write(const std::filesystem::path& file);
/// Replaces the file as a whole, making its folder; "" or why not.
std::string write_whole(const std::filesystem::path& file, const std::string& text);

/// "2026-11-21T22:45:00Z".
std::string utc_now();

}  // namespace takt::graph
