// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "rt/sched/plan.hpp"

namespace takt::command {

struct DoctorOptions {
  bool measure = false, json = false;
};

/// `takt doctor`: tries what Takt asks of the machine and tells what to change. 0 if it ran, whatever it found.
void add_doctor(CLI::App& app, DoctorOptions& options, int& exit_code);

/// What a run under that policy lacks here, with the fixes, as `takt doctor` shows it; "" if nothing. For --require-rt.
/// Before this process has any thread.
std::string lacks_text(Policy policy, bool over_iceoryx);

}  // namespace takt::command
