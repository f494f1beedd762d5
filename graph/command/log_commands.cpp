// SPDX-License-Identifier: Apache-2.0
#include "graph/command/log_commands.hpp"

#include <cstdio>
#include <optional>

#include "graph/cli/outcome.hpp"
#include "graph/log/cut_log.hpp"
#include "graph/log/export_log.hpp"
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

int log_export(const LogOptions& options) {
  return guarded([&]() -> int {
    auto log = open(options.file);
    if (!log) return kBadInput;
    auto sink = mcap::FileSink::open(options.output);
    if (!sink) return refuse("--output " + sink.error() + "; choose another place", kBadInput);
    const auto exported = log::export_log(*log, *sink);
    if (!exported) return refuse(options.output.string() + ": " + exported.error(), kBadInput);
    std::printf("%llu messages, %.1f MB\n", static_cast<unsigned long long>(exported->messages),
                static_cast<double>(exported->bytes) / 1e6);
    if (exported->hash_only > 0)
      std::printf("%llu messages were recorded by their hash only; record them whole with --record-port\n",
                  static_cast<unsigned long long>(exported->hash_only));
    return kOk;
  });
}

int log_cut(const LogOptions& options) {
  return guarded([&]() -> int {
    auto log = open(options.file);
    if (!log) return kBadInput;
    std::error_code none;
    if (std::filesystem::equivalent(options.file, options.output, none))
      return refuse(options.output.string() + ": is the record itself; choose another file", kBadInput);
    auto sink = mcap::FileSink::open(options.output);
    if (!sink) return refuse("--output " + sink.error() + "; choose another place", kBadInput);
    const auto instant = [&](double s) { return log::epoch_ns(*log) + static_cast<int64_t>(s * 1e9); };
    const auto cut = log::cut_log(*log, instant(options.from_s), instant(options.to_s), *sink);
    if (!cut) return refuse(options.output.string() + ": " + cut.error(), kBadInput);
    std::printf("%llu jobs, %llu messages, %.1f MB\n", static_cast<unsigned long long>(cut->jobs),
                static_cast<unsigned long long>(cut->messages), static_cast<double>(cut->bytes) / 1e6);
    return kOk;
  });
}

void add_log(CLI::App& app, LogOptions& o, int& exit_code) {
  CLI::App* log = app.add_subcommand("log", "looks into records");
  log->require_subcommand(1);
  CLI::App* info = log->add_subcommand("info", "what is in a record, what it lost, its hash");
  info->add_option("file", o.file, "what `takt run --record` wrote")->required();
  info->add_flag("--json", o.json, "prints it as JSON");
  info->footer("Example: takt log info run.mcap");
  info->callback([&] { exit_code = log_info(o); });
  CLI::App* diff = log->add_subcommand("diff", "how two records differ: exit 1 if they do");
  diff->add_option("from", o.file, "a record")->required();
  diff->add_option("to", o.other, "another one")->required();
  diff->footer("Example: takt log diff run.mcap again.mcap");
  diff->callback([&] { exit_code = log_diff(o); });
  CLI::App* exported = log->add_subcommand("export", "as MCAP with JSON in Foxglove's schemas");
  exported->add_option("file", o.file, "a record")->required();
  exported->add_option("-o,--output", o.output, "the file to write")->required();
  CLI::App* cut = log->add_subcommand("cut", "a shorter record: the jobs of some seconds and what they held");
  cut->add_option("file", o.file, "a record")->required();
  cut->add_option("-o,--output", o.output, "the file to write")->required();
  cut->add_option("--from", o.from_s, "seconds into the run of the first release")->check(CLI::Range(0.0, 1e9));
  cut->add_option("--to", o.to_s, "seconds into the run, behind the last release")->check(CLI::Range(0.0, 1e9));
  cut->footer("Example: takt log cut run.mcap -o short.mcap --from 2 --to 4");
  cut->callback([&] { exit_code = log_cut(o); });
  exported->footer("Example: takt log export run.mcap -o foxglove.mcap");
  exported->callback([&] { exit_code = log_export(o); });
}

}  // namespace takt::command
