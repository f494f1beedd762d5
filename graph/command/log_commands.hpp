// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "graph/command/log_pull.hpp"
#include "graph/command/log_serve.hpp"
#include "graph/language/registry.hpp"

namespace takt::command {

/// All of these commands end with exit code 1, too, if a record is damaged or cut off, unless `allow_damage`, and if
/// there was nothing to be compared, written or shown.
struct LogOptions {
  std::filesystem::path file, other, output;
  std::string encoding = "json";  ///< of an export: json, cdr
  bool json = false, allow_damage = false;
  std::vector<std::string> ports;
  size_t items = 8;
  double from_s = 0, to_s = 1e9;  ///< since the epoch of the run
  LogPullOptions pull;
  LogServeOptions serve;
};

/// `takt log info FILE`: what a record holds and lacks. Exit 0, 2 if it is no record.
int log_info(const LogOptions& options);
/// `takt log diff A B`. Exit 0 if they hold the same, 1 if not, 2 if one is no record.
int log_diff(const LogOptions& options);

/// `takt log export FILE -o OUT [--encoding json|cdr]`: for programs that know Foxglove's schemas; types of the
/// registry as they show themselves. Exit 0, 1 if some messages cannot be read, 2 if FILE is no record or OUT cannot be
/// written.
int log_export(const Registry& registry, const LogOptions& options);

/// `takt log cut FILE -o OUT [--from S] [--to S]`: a shorter record that can be replayed. Exit 0, 2 as above.
int log_cut(const LogOptions& options);

/// `takt log echo FILE [NODE.PORT...]`: its messages, one JSON object a line. Exit 0, 1 if some cannot be read, 2 if
/// FILE is no record or has no such port.
int log_echo(const LogOptions& options);

void add_log(CLI::App& app, const Registry& registry, LogOptions& options, int& exit_code);

}  // namespace takt::command
