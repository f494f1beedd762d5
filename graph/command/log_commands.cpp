// SPDX-License-Identifier: Apache-2.0
#include "graph/command/log_commands.hpp"

#include <cstdio>
#include <optional>

#include "graph/command/prepare.hpp"
#include "graph/log/log_content.hpp"

namespace takt::command {
namespace {

std::optional<record::LogFile> open(const std::filesystem::path& file) {
  auto log = record::LogFile::open(file);
  if (log) return std::move(*log);
  refuse(log.error(), kBadInput);
  return std::nullopt;
}

/// Runs the command; a record whose plan cannot be read is bad input.
template <class Command>
int guarded(const Command& command) {
  try {
    return command();
  } catch (const log::Json::exception& problem) {
    return refuse(std::string("the record does not hold its plan: ") + problem.what(), kBadInput);
  }
}

}  // namespace

int log_info(const LogOptions& options) {
  return guarded([&]() -> int {
    auto log = open(options.file);
    if (!log) return kBadInput;
    const log::Json content = log::content_json(*log);
    std::fputs((options.json ? content.dump(2) + "\n" : log::content_text(content)).c_str(), stdout);
    return kOk;
  });
}

int log_diff(const LogOptions& options) {
  return guarded([&]() -> int {
    auto from = open(options.file), to = open(options.other);
    if (!from || !to) return kBadInput;
    const log::LogDifference difference = log::difference(*from, *to);
    for (const std::string& line : difference.lines) std::printf("%s\n", line.c_str());
    std::puts(difference.same ? "the same" : "they differ");
    return difference.same ? kOk : kNotOk;
  });
}

void add_log(CLI::App& app, LogOptions& o, int& exit_code) {
  CLI::App* log = app.add_subcommand("log", "looks into records");
  log->require_subcommand(1);
  CLI::App* info = log->add_subcommand("info", "what is in a record, what it lost, its hash");
  info->add_option("file", o.file, "what `takt run --record` wrote")->required();
  info->add_flag("--json", o.json, "prints it as JSON");
  info->callback([&] { exit_code = log_info(o); });
  CLI::App* diff = log->add_subcommand("diff", "how two records differ: exit 1 if they do");
  diff->add_option("from", o.file, "a record")->required();
  diff->add_option("to", o.other, "another one")->required();
  diff->callback([&] { exit_code = log_diff(o); });
}

}  // namespace takt::command
