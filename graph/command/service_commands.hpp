// SPDX-License-Identifier: Apache-2.0
// `takt status | logs`: how the services takt@NAME of this machine do, in plain words, and what they said.
//
//   $ takt status
//   ace: active (running) since Mon 2026-11-30 08:12:01 UTC; mode full
#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace takt::command {

struct ServiceOptions {
  std::string name;  ///< of a service takt@NAME; empty: all
  std::string since;
  bool follow = false, json = false;
};

/// What `systemctl show` says of one service.
struct ServiceState {
  std::string name, active, sub, status, since, result;
  int restarts = 0;
  bool runs() const { return active == "active"; }
};
/// From its output: blocks of KEY=VALUE with empty lines between them. Blocks without a name takt@NAME.service are
/// passed over.
std::vector<ServiceState> services(std::string_view shown);
/// "ace: failed (watchdog), restarted 5 times; mode full; not fed: stereo missed a deadline".
std::string service_text(const ServiceState& service);

/// Adds both. Exit 0: all run; 1: one does not; 2: a wrong name; 3: no systemd, or no such service.
void add_service_commands(CLI::App& app, ServiceOptions& options, int& exit_code);

}  // namespace takt::command
