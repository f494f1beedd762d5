// SPDX-License-Identifier: Apache-2.0
#include "graph/command/replay_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <iostream>

#include "graph/cli/file_option.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/command/what_if_command.hpp"
#include "graph/log/damages.hpp"
#include "graph/rewind/bisect.hpp"
#include "graph/rewind/inspector.hpp"
#include "graph/rewind/shown_replay.hpp"
#include "graph/run/isolated_replay.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/support.hpp"
#include "graph/run/web_beside.hpp"

namespace takt::command {
namespace {

using rewind::judged;
using rewind::RecordedRun;

class Replay {
 public:
  explicit Replay(const ReplayOptions& options) : options_(options), run_(options) {}

  RunOptions& open() { return run_.open(); }

  int run(const Registry& registry) {
    // Before this process has a second thread.
    if (const int code = options_.web ? prepare_web() : kOk; code != kOk) return code;
    if (const int code = run_.compose(registry); code != kOk) return code;
    if (options_.inspect || !options_.until_condition.empty()) return explore();
    return judge(replay([&](const ReplayPart& part) {
      return options_.recorded_pace ? run_shown(registry, part) : run_.run(part.how);
    }));
  }

  int rehearse(const Registry& registry) { return run_.compose(registry); }

  /// After a rehearsal in another process: `registry` has descriptions, and each process of the replay loads plug-ins.
  int run_apart(const Registry& registry) {
    if (const int code = run_.outline(registry); code != kOk) return code;
    return judge(replay([&](const ReplayPart& part) {
      run_.compose_again();
      return run_.run(part.how);
    }));
  }

 private:
  int prepare_web() {
    const auto program = web_program();
    if (!program) return refuse(program.error(), kDeviceOrSystem);
    web_.emplace(std::vector<std::string>{*program, "--with-run", std::to_string(getpid()), "--port", "0"});
    return kOk;
  }

  record::ReplayResult run_shown(const Registry& registry, const ReplayPart& part) {
    rewind::ShownReplay shown(run_, registry, part.how);
    std::vector<std::string> adjusted;
    tell_attach(shown.server(), adjusted);
    if (web_)
      if (const auto begun = web_->begin(); !begun) throw std::runtime_error(begun.error());
    return run_.run(shown.how());
  }

  /// --break, --inspect.
  int explore() {
    rewind::Inspector inspector(run_);
    const auto& asked = run_.graph().asked;
    if (!asked.empty()) {
      const auto found = inspector.go_to(asked.front());
      std::fputs(found.text.c_str(), stdout);
      if (!options_.inspect || !found.there) return found.there ? kOk : kNotOk;
    }
    if (asked.empty()) std::fputs(inspector.answer("first").text.c_str(), stdout);
    const bool person = isatty(STDIN_FILENO) != 0;
    const auto prompt = [&] { return person && std::fputs("takt> ", stdout) >= 0 && std::fflush(stdout) == 0; };
    bool all_found = true;
    static_cast<void>(prompt());
    for (std::string line; std::getline(std::cin, line); static_cast<void>(prompt())) {
      if (line == "quit" || line == "q") break;
      const auto answer = inspector.answer(line);
      std::fputs(answer.text.c_str(), stdout);
      all_found = all_found && answer.there;
    }
    return all_found || person ? kOk : kNotOk;
  }

  record::ReplayResult replay(const std::function<record::ReplayResult(const ReplayPart&)>& run_part) {
    const std::vector<ReplayPart> parts = run_.parts();
    const int64_t before_ns = clock_.now_ns();
    processes_ = parts.size();
    auto result = options_.isolate == "subsystem" ? replay_isolated(parts, run_part) : run_part(parts.front());
    took_ns_ = clock_.now_ns() - before_ns;
    return result;
  }

  int judge(const record::ReplayResult& result) {
    const int code = tell(result);
    if (code != kOk || !run_.damaged()) return code;
    return refuse(log::damages_text(options_.log, run_.log()) + "; --allow-damage goes on with what is left", kNotOk);
  }

  int tell(const record::ReplayResult& result) {
    const double recorded_s = static_cast<double>(result.recorded_ns) / 1e9;
    const double took_s = static_cast<double>(took_ns_) / 1e9;
    fmt::print("replayed {} jobs in {} process{}, {:.1f} s in {:.1f} s ({:.1f}x real time)\n", result.jobs, processes_,
               processes_ == 1 ? "" : "es", recorded_s, took_s, took_s > 0 ? recorded_s / took_s : 0.0);
    if (result.restarts > 0) fmt::print("{} restarts of nodes done again\n", result.restarts);
    if (result.begun > 0) fmt::print("{} nodes went on from a snapshot\n", result.begun);
    if (result.begun_afresh > 0)
      fmt::print("{} nodes began without what they remember ({}); what they make may differ\n", result.begun_afresh,
                 result.stateless);
    for (const mcap::Channel& channel : run_.log().container().channels())
      if (const auto fields = channel.metadata.find("fields");
          fields != channel.metadata.end() && fields->second.starts_with("jpeg"))
        fmt::print("{} was recorded as {}: its pictures, and what nodes make of them, are not those of the run\n",
                   channel.topic, fields->second);
    if (result.uncommitted > 0)
      fmt::print("{} jobs were not run: their process was lost before they published\n", result.uncommitted);
    if (result.lacking > 0)
      fmt::print("{} jobs were not run: the record lost what they were given ({})\n", result.lacking,
                 result.first_lacking.empty() ? "their node did not begin" : result.first_lacking);
    if (result.unmade > 0)
      fmt::print("{} messages are not compared: the record has their hash only, and lacks the jobs that made them\n",
                 result.unmade);
    // A record without an end lacks the last jobs, as it says.
    const bool lacking = result.lacking > 0 || (result.unmade > 0 && !run_.log().end().empty());
    if (result.jobs == 0 && !StopOnSignal::asked())
      return refuse(options_.log.string() + ": nothing was replayed, the record has no job to be run", kNotOk);
    if (!options_.compare) return lacking ? kNotOk : kOk;
    if (result.compared == 0 && !StopOnSignal::asked())
      return refuse(options_.log.string() + ": nothing was compared", kNotOk);
    fmt::print("compared {} of {} messages: {} field by field, {} by hash; {} differ\n", result.compared,
               result.messages, result.whole, result.compared - result.whole, result.different);
    if (result.first) {
      const record::Divergence& first = *result.first;
      fmt::print("first difference: {}{}{}, job {} (released {:.3f} s after the epoch): {}\n", first.node,
                 first.port.empty() ? "" : ".", first.port, first.job,
                 static_cast<double>(first.release_ns - run_.epoch_ns()) / 1e9, first.what);
      for (const auto& [node, count] : result.different_of) fmt::print("  {}: {} differ\n", node, count);
    }
    if (result.different > 0 && run_.log().format() == 1)
      fmt::print(
          "a record of format 1 does not tell where a process was started again: what its nodes publish after "
          "that differs. Record again, or replay up to there: takt log cut --to S\n");
    return result.different > 0 || lacking ? kNotOk : kOk;
  }

  const ReplayOptions& options_;
  RecordedRun run_;
  std::optional<WebBeside> web_;
  MonotonicClock clock_;
  int64_t took_ns_ = 0;
  size_t processes_ = 1;
};

int tell_break(const BisectOptions& options, const RecordedRun& run, const rewind::Bisected& found) {
  const double replayed_s = static_cast<double>(found.replayed_ns) / 1e9;
  const auto at_s = [&](int64_t ns) { return static_cast<double>(ns - run.epoch_ns()) / 1e9; };
  if (options.json) {
    log::Json json{
        {"condition", found.condition}, {"replays", found.replays}, {"replayed_s", replayed_s}, {"first", nullptr}};
    if (found.first)
      json["first"] = {{"node", found.first->node},
                       {"job", found.first->job},
                       {"released_s", at_s(found.first->release_ns)},
                       {"value", found.first->value}};
    std::puts(json.dump().c_str());
  } else if (found.first) {
    fmt::print("first broken: {} job {}, released {:.3f} s into the run: {}\n", found.first->node, found.first->job,
               at_s(found.first->release_ns), found.first->value);
  } else {
    fmt::print("it holds at the end; what breaks it for a while only is found by takt replay --break\n");
  }
  if (!options.json) fmt::print("{}: {} replays of {:.1f} s in all\n", found.condition, found.replays, replayed_s);
  return found.first ? kOk : kNotOk;
}

}  // namespace

int bisect(plugin::Plugins& plugins, const BisectOptions& options) {
  return judged(options, [&] {
    RecordedRun run(options);
    RunOptions& recorded = run.open();
    return plugins.carry_out(recorded.graph, recorded.load, [&](const Registry& known) {
      const StopOnSignal guard;
      return judged(options, [&] {
        if (const int code = run.compose(known); code != kOk) return code;
        return tell_break(options, run, rewind::bisect(run, run.graph().asked.at(0)));
      });
    });
  });
}

int replay(plugin::Plugins& plugins, const ReplayOptions& options) {
  if (options.asks_what_if() || options.json || !options.report.empty()) return what_if(plugins, options);
  std::vector<WriterLock> locks;
  if (const int code = claim_folder(options.output, locks); code != kOk) return code;
  return judged(options, [&] {
    Replay replay(options);
    RunOptions& run = replay.open();
    const auto stoppable = [&](const std::function<int()>& part) {
      const StopOnSignal guard;
      return judged(options, part);
    };
    const bool apart = options.isolate == "subsystem" && plugin::are_named(run.graph, run.load);
    const int code = plugins.carry_out(run.graph, run.load, [&](const Registry& known) {
      return stoppable([&] { return apart ? replay.rehearse(known) : replay.run(known); });
    });
    if (!apart || code != kOk) return code;
    return plugins.supervise(run.graph, run.load,
                             [&](const Registry& known) { return stoppable([&] { return replay.run_apart(known); }); });
  });
}

void add_replay(CLI::App& app, plugin::Plugins& plugins, ReplayOptions& o, int& exit_code) {
  CLI::App* replay =
      app.add_subcommand("replay", "runs the jobs of a record again, or predicts them on another schedule");
  reads_file(replay->add_option("log", o.log, "what `takt run --record` wrote"), UINT64_MAX)->required();
  reads_file(replay->add_option("graph", o.graph, "graph file instead of that of the record"));
  replay->add_flag("--compare", o.compare, "bit by bit with the record; exit 1 on the first message that differs");
  replay->add_flag("--allow-damage", o.allow_damage, "a record that is damaged or cut off is no failure");
  replay->add_option("--live", o.live, "runs only these nodes, with the rest from the record")->delimiter(',');
  reads_file(replay->add_option("--params", o.params, "parameter file of the robot instead of that of the record"));
  replay->add_option("--set", o.set, "node.param=value, repeatable");
  add_plugin_option(*replay, o.plugin_files);
  replay->add_option("--from", o.from_s, "begins so many seconds into the run, from the snapshots before that");
  replay->add_option("--until", o.until_s, "ends so many seconds into the run");
  replay->add_option("--break", o.until_condition,
                     "ends at the first job whose message passes, such as 'port: ego_motion.motion, field: valid, "
                     "at_most: 0', and shows it");
  replay->add_flag("--inspect", o.inspect, "shows one job after the other; asks which (help)");
  CLI::Option* isolate =
      replay->add_option("--isolate", o.isolate, "none (one process) | subsystem: as many as the run had")
          ->check(CLI::IsMember({"none", "subsystem"}));
  replay->add_flag("--recorded-pace", o.recorded_pace,
                   "as fast as it was, instead of as fast as possible; in one process takt top, echo and web show it");
  replay->add_flag("--web", o.web, "with takt web beside it, at a free port of this machine, at the pace of the record")
      ->excludes(isolate);
  writes_folder(replay->add_option("--output", o.output, "folder for pictures and other results (default out)"));
  add_what_if_options(*replay, o);
  replay->footer(
      "Example: takt replay run.mcap --compare\n"
      "Example: takt replay run.mcap --schedule other.yaml --cores 1 --speed 0.5\n"
      "Example: takt replay run.mcap --live ground_map --set ground_map.votes_min=7\n"
      "Example: takt replay run.mcap --from 95 --inspect");
  replay->callback([&] {
    if (!o.until_condition.empty()) o.conditions.push_back(o.until_condition);
    o.recorded_pace = o.recorded_pace || o.web;
    exit_code = command::replay(plugins, o);
  });
}

void add_bisect(CLI::App& app, plugin::Plugins& plugins, BisectOptions& o, int& exit_code) {
  CLI::App* bisect =
      app.add_subcommand("bisect", "finds the first job of a record from which on a condition does not hold");
  reads_file(bisect->add_option("log", o.log, "what `takt run --record` wrote"), UINT64_MAX)->required();
  bisect->add_option("condition", o.condition, "as in `expect` of a graph: 'port: X.Y, field: Z, at_least: 1m/s'")
      ->required();
  reads_file(bisect->add_option("--graph", o.graph, "graph file instead of that of the record"));
  bisect->add_option("--set", o.set, "node.param=value, repeatable");
  add_plugin_option(*bisect, o.plugin_files);
  bisect->add_flag("--json", o.json, "one JSON object");
  bisect->footer("Example: takt bisect run.mcap 'port: robot_pose.odometry, field: transform.x, at_most: 10m'");
  bisect->callback([&] {
    o.conditions.push_back(o.condition);
    exit_code = command::bisect(plugins, o);
  });
}

}  // namespace takt::command
