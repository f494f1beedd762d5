// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "graph/evaluate/ego_motion_drive.hpp"
#include "hal/settings/json.hpp"

namespace takt::command {

/// An estimate that errs by more is wrong: three times what half of all steps may err.
inline constexpr double kWrong_m = 0.015, kWrongShare = 0.06, kWrong_deg = 0.3;

/// Errors per step of a drive (median_mm, p95_mm, median_pct, median_deg, p95_deg), how often and how rightly a motion
/// was refused, how often a wrong one was not, how often the stated covariance holds; beside them the errors of zero
/// motion and of the step before continued.
nlohmann::ordered_json score(const Drive& drive, const Track& track);

/// A number of a row as text, "-" where there is none.
std::string text(const nlohmann::ordered_json& row, const char* key, int digits);

}  // namespace takt::command
