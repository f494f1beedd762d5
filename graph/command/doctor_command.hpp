// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace takt::command {

struct DoctorOptions {
  bool measure = false, json = false, require_rt = false;
  std::string peer;  ///< address of another machine that the way to is measured; empty: none
  uint16_t port = 7390;
};

/// `takt doctor`: tries what Takt asks of the machine and tells what to change. 0 if it ran, whatever it found; with
/// `require_rt` 1 where a run under a real-time policy would be refused.
void add_doctor(CLI::App& app, DoctorOptions& options, int& exit_code);

}  // namespace takt::command
