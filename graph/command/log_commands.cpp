// SPDX-License-Identifier: Apache-2.0
#include "graph/command/log_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <initializer_list>
#include <optional>
#include <utility>

#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/flight/left_runs.hpp"
#include "graph/log/cut_log.hpp"
#include "graph/log/damages.hpp"
#include "graph/log/echo_log.hpp"
#include "graph/log/export_log.hpp"
#include "graph/log/log_content.hpp"

namespace takt::command {
namespace {

std::optional<record::LogFile> open(const std::filesystem::path& file) {
  auto log = record::LogFile::open(file);
  if (log) {
    for (const std::string& left : log->left_out())
      std::fprintf(stderr, "takt: %s: left out: %s\n", file.c_str(), left.c_str());
    return std::move(*log);
  }
  refuse(log.error(), kBadInput);
  return std::nullopt;
}

/// The exit code of a command that has read those records: what could not be read is a failure, unless it is allowed.
int whole(const LogOptions& options, int code, std::initializer_list<const record::LogFile*> logs) {
  const std::filesystem::path* name = &options.file;
  for (const record::LogFile* log : logs) {
    const std::string damages = log::damages_text(*std::exchange(name, &options.other), *log);
    if (damages.empty()) continue;
    if (options.allow_damage) std::fprintf(stderr, "takt: %s\n", damages.c_str());
    else code = std::max<int>(code, refuse(damages + "; --allow-damage goes on with what is left", kNotOk));
  }
  return code;
}

/// The new record or export, next to its place until it is whole.
struct NewLog {
  std::optional<OutputFile> claim;
  std::optional<mcap::FileSink> sink;
};

/// 0, or the exit code once the reason is on stderr.
int make(const std::filesystem::path& file, NewLog& made) {
  auto claim = OutputFile::claim(file);
  if (!claim) return refuse(claim.error(), "--output");
  made.claim.emplace(std::move(*claim));
  const auto part = made.claim->part();
  auto sink = mcap::FileSink::open(part.empty() ? file : part);
  if (!sink) return refuse("--output " + sink.error() + "; choose another place", kBadInput);
  made.sink.emplace(std::move(*sink));
  return kOk;
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
    return whole(options, kOk, {&*log});
  });
}

int log_diff(const LogOptions& options) {
  return guarded([&]() -> int {
    auto from = open(options.file), to = open(options.other);
    if (!from || !to) return kBadInput;
    const log::LogDifference difference = log::difference(*from, *to);
    for (const std::string& line : difference.lines) std::printf("%s\n", line.c_str());
    if (difference.same && from->jobs().empty() && difference.messages == 0)
      return whole(options, refuse("nothing was compared: both records are empty", kNotOk), {&*from, &*to});
    std::puts(difference.same ? "the same" : "they differ");
    return whole(options, difference.same ? kOk : kNotOk, {&*from, &*to});
  });
}

int log_export(const Registry& registry, const LogOptions& options) {
  return guarded([&]() -> int {
    auto log = open(options.file);
    if (!log) return kBadInput;
    NewLog made;
    if (const int code = make(options.output, made); code != kOk) return code;
    const auto exported =
        log::export_log(*log, graph::message_types(registry),
                        options.encoding == "cdr" ? log::cdr_encoding() : log::json_encoding(), *made.sink);
    if (!exported) return refuse(options.output.string() + ": " + exported.error(), kBadInput);
    if (exported->messages + exported->hash_only == 0)
      return whole(options, refuse(options.file.string() + ": has no message to be exported", kNotOk), {&*log});
    if (const auto done = made.claim->finish(); !done) return refuse(done.error(), "--output");
    std::printf("%llu messages, %.1f MB\n", static_cast<unsigned long long>(exported->messages),
                static_cast<double>(exported->bytes) / 1e6);
    if (exported->states > 0)
      std::printf("%llu states of nodes were left out: only a replay reads them\n",
                  static_cast<unsigned long long>(exported->states));
    if (exported->hash_only > 0)
      std::printf("%llu messages were recorded by their hash only; record them whole with --record-port\n",
                  static_cast<unsigned long long>(exported->hash_only));
    if (exported->showed_nothing > 0)
      std::printf("%llu messages show nothing, such as a picture without pixels, and were left out\n",
                  static_cast<unsigned long long>(exported->showed_nothing));
    if (!exported->own_fields.empty())
      std::printf("by their own fields, as Foxglove has no schema for them: %s\n",
                  fmt::format("{}", fmt::join(exported->own_fields, ", ")).c_str());
    if (exported->unreadable == 0) return whole(options, kOk, {&*log});
    std::printf("%llu messages cannot be read and are not in it; the first: %s\n",
                static_cast<unsigned long long>(exported->unreadable), exported->first_unreadable.c_str());
    return whole(options, kNotOk, {&*log});
  });
}

int log_cut(const LogOptions& options) {
  return guarded([&]() -> int {
    auto log = open(options.file);
    if (!log) return kBadInput;
    std::error_code none;
    if (std::filesystem::equivalent(options.file, options.output, none))
      return refuse(options.output.string() + ": is the record itself; choose another file", kBadInput);
    NewLog made;
    if (const int code = make(options.output, made); code != kOk) return code;
    const auto instant = [&](double s) { return log::epoch_ns(*log) + static_cast<int64_t>(s * 1e9); };
    const auto cut = log::cut_log(*log, instant(options.from_s), instant(options.to_s), *made.sink);
    if (!cut) return refuse(options.output.string() + ": " + cut.error(), kBadInput);
    if (cut->jobs + cut->messages == 0)
      return whole(options, refuse(options.file.string() + ": has no job between --from and --to", kNotOk), {&*log});
    if (const auto done = made.claim->finish(); !done) return refuse(done.error(), "--output");
    std::printf("%llu jobs, %llu messages, %.1f MB\n", static_cast<unsigned long long>(cut->jobs),
                static_cast<unsigned long long>(cut->messages), static_cast<double>(cut->bytes) / 1e6);
    return whole(options, kOk, {&*log});
  });
}

int log_rescue(const LogOptions& options) {
  NewLog made;
  if (const int code = make(options.output, made); code != kOk) return code;
  const auto rescued = flight::rescue(options.file, *made.sink);
  if (!rescued) return refuse(options.output.string() + ": " + rescued.error(), kBadInput);
  for (const std::string& damage : rescued->joined.damages) std::fprintf(stderr, "takt: %s\n", damage.c_str());
  if (const auto done = made.claim->finish(); !done) return refuse(done.error(), "--output");
  std::printf("%s: %llu messages of %.1f s, %.1f MB, from %zu files\n", rescued->run.c_str(),
              static_cast<unsigned long long>(rescued->joined.messages),
              static_cast<double>(rescued->joined.last_ns - rescued->joined.first_ns) / 1e9,
              static_cast<double>(rescued->joined.bytes) / 1e6, rescued->files.size());
  return kOk;
}

int log_echo(const LogOptions& options) {
  return guarded([&]() -> int {
    auto log = open(options.file);
    if (!log) return kBadInput;
    const auto echoed = log::echo_log(*log, options.ports, options.items, [](const log::Json& line) {
      std::puts(line.dump(-1, ' ', false, log::Json::error_handler_t::replace).c_str());  // a text may be no UTF-8
    });
    if (!echoed) return refuse(options.file.string() + ": " + echoed.error(), kBadInput);
    if (echoed->hash_only > 0)
      std::fprintf(stderr,
                   "takt: %llu messages were recorded by their hash only; record them whole with --record-port\n",
                   static_cast<unsigned long long>(echoed->hash_only));
    if (echoed->messages == 0 && echoed->unreadable == 0)
      return whole(options, refuse(options.file.string() + ": has no such message", kNotOk), {&*log});
    if (echoed->unreadable == 0) return whole(options, kOk, {&*log});
    return refuse(fmt::format("{} messages cannot be read and are left out; the first: {}", echoed->unreadable,
                              echoed->first_unreadable),
                  kNotOk);
  });
}

void add_log(CLI::App& app, const Registry& registry, LogOptions& o, int& exit_code) {
  CLI::App* log = app.add_subcommand("log", "looks into records");
  log->require_subcommand(1);
  CLI::App* info = log->add_subcommand("info", "what is in a record, what it lost, its hash");
  reads_file(info->add_option("file", o.file, "what `takt run --record` wrote"), UINT64_MAX)->required();
  info->add_flag("--json", o.json, "prints it as JSON");
  info->footer("Example: takt log info run.mcap");
  info->callback([&] { exit_code = log_info(o); });
  CLI::App* diff = log->add_subcommand("diff", "how two records differ: exit 1 if they do");
  reads_file(diff->add_option("from", o.file, "a record"), UINT64_MAX)->required();
  reads_file(diff->add_option("to", o.other, "another one"), UINT64_MAX)->required();
  diff->footer("Example: takt log diff run.mcap again.mcap");
  diff->callback([&] { exit_code = log_diff(o); });
  CLI::App* echo = log->add_subcommand("echo", "its messages, one JSON object a line");
  reads_file(echo->add_option("file", o.file, "a record"), UINT64_MAX)->required();
  echo->add_option("ports", o.ports, "NODE.PORT (default: all)");
  echo->add_option("--items", o.items, "of longer arrays so many elements (default 8)");
  echo->footer("Example: takt log echo run.mcap base.odometry");
  echo->callback([&] { exit_code = log_echo(o); });
  CLI::App* exported = log->add_subcommand("export", "as MCAP in Foxglove's schemas, with JSON or CDR");
  reads_file(exported->add_option("file", o.file, "a record"), UINT64_MAX)->required();
  writes_file(exported->add_option("-o,--output", o.output, "the file to write"))->required();
  exported
      ->add_option("--encoding", o.encoding,
                   "json, with raw pictures; or cdr, the bytes of ROS 2 with ros2msg schemas, with pictures as JPEG")
      ->check(CLI::IsMember({"json", "cdr"}))
      ->capture_default_str();
  CLI::App* cut = log->add_subcommand("cut", "a shorter record: the jobs of some seconds and what they held");
  reads_file(cut->add_option("file", o.file, "a record"), UINT64_MAX)->required();
  writes_file(cut->add_option("-o,--output", o.output, "the file to write"))->required();
  cut->add_option("--from", o.from_s, "seconds into the run of the first release")->check(CLI::Range(0.0, 1e9));
  cut->add_option("--to", o.to_s, "seconds into the run, behind the last release")->check(CLI::Range(0.0, 1e9));
  cut->footer("Example: takt log cut run.mcap -o short.mcap --from 2 --to 4");
  cut->callback([&] { exit_code = log_cut(o); });
  CLI::App* rescue = log->add_subcommand("rescue", "one record of what the ring of the last run in a folder still has");
  reads_folder(rescue->add_option("folder", o.file, "OUTPUT/flight/ring of a run that may have been killed"))
      ->required();
  writes_file(rescue->add_option("-o,--output", o.output, "the file to write"))->required();
  rescue->footer("Example: takt log rescue out/flight/ring -o last.mcap");
  rescue->callback([&] { exit_code = log_rescue(o); });
  add_log_pull(*log, o.pull, exit_code);
  add_log_serve(*log, o.serve, exit_code);
  for (CLI::App* command : {info, diff, echo, exported, cut})
    command->add_flag("--allow-damage", o.allow_damage, "a record that is damaged or cut off is no failure");
  exported->footer("Example: takt log export run.mcap -o foxglove.mcap --encoding cdr");
  exported->callback([&] { exit_code = log_export(registry, o); });
}

}  // namespace takt::command
