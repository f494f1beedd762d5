// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <opencv2/core/utils/logger.hpp>
#include <string_view>

#include "graph/ace/ace_registry.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/command/attach_commands.hpp"
#include "graph/command/capture_command.hpp"
#include "graph/command/check_command.hpp"
#include "graph/command/devices_command.hpp"
#include "graph/command/doctor_command.hpp"
#include "graph/command/double_command.hpp"
#include "graph/command/explain_command.hpp"
#include "graph/command/log_commands.hpp"
#include "graph/command/profile_command.hpp"
#include "graph/command/replay_command.hpp"
#include "graph/command/robot_command.hpp"
#include "graph/command/show_command.hpp"
#include "graph/language/overlay.hpp"
#include "graph/run/run.hpp"
#include "rt/capability.hpp"

namespace {

/// "20s", "1.5min", "0s": a duration with its unit, in seconds.
std::string duration(std::string& text) {
  static const std::map<std::string, double> units{{"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}};
  size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    return "is no duration; write for instance 20s";
  }
  const auto unit = units.find(text.substr(used));
  if (unit == units.end() || value < 0) return "is no duration; write a number with ms, s, min or h, for instance 20s";
  text = std::to_string(value * unit->second);
  return "";
}

void add_load_options(CLI::App& app, std::filesystem::path& graph, takt::graph::LoadOptions& load) {
  app.add_option("graph", graph, "graph file (default graph/ace.yaml)");
  app.add_option("--profile", load.profile, "sim | replay | robot, as the graph defines them");
  app.add_option("--schedule", load.schedule, "schedule file instead of the graph's");
  app.add_option("--policy", load.policy, "deadline | fixed | cooperative instead of the schedule's");
  app.add_option("--mode", load.mode, "a mode of the graph (default full)");
  app.add_option("--set", load.set, "node.param=value, repeatable");
}

/// For what runs or judges a graph as it will run: with the values that `takt set --keep` left for it.
void add_overlay_option(CLI::App& app, takt::graph::LoadOptions& load) {
  load.state = takt::graph::state_folder();
  app.add_flag_callback(
      "--no-overlay", [&load] { load.state.clear(); }, "without the values that `takt set --keep` left for the graph");
}

void add_show(CLI::App& app, const takt::Registry& registry, takt::command::ShowOptions& o, int& exit_code) {
  CLI::App* show = app.add_subcommand("show", "draws a graph, or lists what each node reads");
  add_load_options(*show, o.graph, o.load);
  CLI::Option* svg = show->add_option("--svg", o.svg, "writes the picture as an SVG file");
  show->add_flag("--dot", o.dot, "prints Graphviz text")->excludes(svg);
  show->callback([&] { exit_code = takt::command::show_graph(registry, o); });
}

void add_report(CLI::App& app, const takt::Registry& registry, takt::command::RenderOptions& o, int& exit_code) {
  CLI::App* report = app.add_subcommand("report", "makes a page for people from the report of a run");
  report->add_option("report", o.report, "what `takt run --report` wrote")->required();
  report->add_option("graph", o.graph, "graph file of the run (default graph/ace.yaml)");
  report->add_option("--schedule", o.schedule, "schedule file of the run, if it was not the graph's");
  report->add_option("--html", o.html, "writes the page to this file")->required();
  report->add_option("--output", o.output, "folder with the pictures of the run (default out)");
  report->callback([&] { exit_code = takt::command::render_report(registry, o); });
}

void add_explain(CLI::App& app, takt::command::ExplainOptions& o, int& exit_code) {
  CLI::App* explain = app.add_subcommand("explain", "says why jobs missed their deadlines, one sentence each");
  explain->add_option("file", o.file, "what `takt run --trace` wrote (or --report, which says less)")->required();
  explain->add_option("node", o.node, "only this node");
  explain->add_option("--svg", o.svg, "draws the largest of the misses told");
  explain->callback([&] { exit_code = takt::command::explain_misses(o); });
}

void add_run(CLI::App& app, const takt::Registry& registry, takt::command::RunOptions& o, int& exit_code) {
  CLI::App* run = app.add_subcommand("run", "runs a graph and reports what happened");
  add_load_options(*run, o.graph, o.load);
  add_overlay_option(*run, o.load);
  CLI::Option* how_long = run->add_option("--for", o.duration_s,
                                          "how long, e.g. 20s; 0s: until stopped (default: 20s, or as the graph's "
                                          "`expect` says)")
                              ->transform(CLI::Validator(duration, "DURATION"));
  run->add_option("--clock", o.clock, "real | virtual")->check(CLI::IsMember({"real", "virtual"}));
  run->add_option("--durations", o.durations,
                  "what jobs take in virtual time: budgets | random (half a budget to a whole one) | a record");
  run->add_option("--transport", o.transport, "local | iceoryx (default: local)")
      ->check(CLI::IsMember({"local", "iceoryx"}));
  run->add_option("--isolate", o.isolate, "none (one process) | subsystem")
      ->check(CLI::IsMember({"none", "subsystem"}));
  run->add_option("--report", o.report, "writes the report as JSON");
  run->add_option("--html", o.html, "writes the report as one page to be read offline");
  run->add_option("--trace", o.trace, "writes a trace for https://ui.perfetto.dev and `takt explain`");
  run->add_option("--trace-source", o.trace_source,
                  "how preemption is seen: auto (the best granted) | tracefs | perf | none")
      ->check(CLI::IsMember({"auto", "tracefs", "perf", "none"}));
  run->add_option("--record", o.record, "writes an MCAP record for `takt replay` and `takt log`");
  run->add_option("--record-port", o.record_ports,
                  "NODE.PORT (or all): its messages whole, as those of devices and small ones are; repeatable");
  run->add_option("--faults", o.faults, "a scenario: injects its faults and exits 0 exactly if what it expects is met");
  run->add_option("--output", o.output, "folder for pictures and other results (default out)");
  run->add_option("--seed", o.seed, "seed of the simulated world");
  run->add_option("--watchdog", o.watchdog,
                  "device (/dev/watchdog) that resets the machine unless all high-criticality nodes are well");
  run->add_option("--watchdog-timeout", o.watchdog_timeout_s, "seconds until it does (default 10)")
      ->check(CLI::Range(1, 3600));
  run->add_flag("--unchecked", o.unchecked, "runs what the check refuses");
  run->add_flag("--require-rt", o.require_rt,
                "exit 3 where the machine lacks what `takt doctor` checks for such a run");
  run->callback([&, how_long] {
    o.duration_asked = how_long->count() > 0;
    exit_code = takt::command::run_graph(registry, o);
  });
}

void add_devices(CLI::App& app, bool& json, int& exit_code) {
  CLI::App* devices = app.add_subcommand("devices", "lists what is plugged in, and a line of the graph file for each");
  devices->add_flag("--json", json, "prints the list as JSON");
  devices->callback([&] { exit_code = takt::command::list_devices(json); });
}

void add_capture(CLI::App& app, takt::command::CaptureOptions& o, int& exit_code) {
  CLI::App* capture = app.add_subcommand("capture", "writes what a device says to a file");
  capture->add_option("device", o.device, "can0, /dev/ttyUSB0, or 192.168.0.1:2111")->required();
  capture->add_option("file", o.file, "file to be written")->required();
  capture->add_option("--for", o.duration_s, "how long, e.g. 20s (default 10s)")
      ->transform(CLI::Validator(duration, "DURATION"));
  capture->add_option("--scanner", o.scanner, "lms200 | lms400: it is asked for scans meanwhile");
  capture->add_option("--baud", o.baud, "of a serial line (default 38400)");
  capture->callback([&] { exit_code = takt::command::capture_device(o); });
}

void add_profile(CLI::App& app, const takt::Registry& registry, takt::command::ProfileOptions& o, int& exit_code) {
  CLI::App* profile = app.add_subcommand("profile", "measures execution times and writes budgets into a schedule");
  add_load_options(*profile, o.run.graph, o.run.load);
  add_overlay_option(*profile, o.run.load);
  profile->add_option("--for", o.run.duration_s, "how long each of the two passes lasts, e.g. 20s")
      ->transform(CLI::Validator(duration, "DURATION"));
  profile->add_option("--seed", o.run.seed, "seed of the simulated world");
  profile->add_option("--quantile", o.quantile, "of the execution times (default 0.99)")->check(CLI::Range(0.01, 1.0));
  profile->add_option("--margin", o.margin, "budget = margin x quantile (default 1.2)")->check(CLI::Range(0.1, 100.0));
  CLI::Option* write = profile->add_option("--write", o.write, "writes the schedule with the budgets to this file");
  CLI::Option* in_place = profile->add_flag("--in-place", o.in_place, "writes them into the schedule itself");
  CLI::Option* compare = profile->add_option("--compare", o.compare, "compares with this schedule: exit 1 if above");
  CLI::Option* keep =
      profile->add_flag("--keep-budgets", o.keep_budgets, "writes what was measured, and leaves budgets");
  profile->add_option("--tolerance", o.tolerance, "by how much a node may be above (default 20%)")->needs(compare);
  in_place->excludes(write)->excludes(compare);
  write->excludes(compare);
  keep->excludes(compare);
  profile->callback([&] { exit_code = takt::command::profile_graph(registry, o); });
}

/// A command of another program, which stands next to this one: no run needs it, so nobody waits for it to be built.
struct DeskCommand {
  const char *name, *what, *program;
};
constexpr DeskCommand kDeskCommands[] = {
    {"calibrate", "measures cameras and lasers from recordings", "takt-tools"},
    {"cloud", "filters point clouds in PLY and PCD files", "takt-tools"},
    {"objects", "the database of known objects: what is in it, learning, tuning", "takt-tools"},
    {"terrain", "kinds of terrain that ground_map tells apart", "takt-tools"},
    {"train", "learns what nodes look for", "takt-tools"},
    {"eval", "measures quality against ground truth", "takt-eval"},
};

/// Hands the whole command line over to the program of `command`. Returns only where that cannot be started.
int become(const DeskCommand& command, char** arguments) {
  const std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename(command.program);
  const bool names_itself = std::string_view(command.program) == "takt-eval";  // a program of one command
  execv(program.c_str(), names_itself ? arguments + 1 : arguments);
  return takt::command::refuse(program.string() + " cannot be started: " + std::strerror(errno) + "\n  fix: `./takt " +
                                   command.name + "` of a checkout builds it (target " + command.program + ")",
                               takt::command::kDeviceOrSystem);
}

}  // namespace

int main(int argc, char** argv) {
  takt::command::hold_standard_streams();
  takt::keep_rights(takt::Rights::observe);
  for (const DeskCommand& command : kDeskCommands)
    if (argc > 1 && std::string_view(argv[1]) == command.name) return become(command, argv);
  // Files that cannot be read are reported by the commands themselves, with the next step.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  CLI::App app{"Takt: a real-time dataflow runtime with a static task graph"};
  app.require_subcommand(1);
  takt::command::RunOptions run_options, check_options;
  takt::command::ShowOptions show_options;
  takt::command::RenderOptions render_options;
  takt::command::ExplainOptions explain_options;
  takt::command::AttachOptions attach;
  takt::command::RobotOptions robot;
  takt::command::DoctorOptions doctor;
  takt::command::ProfileOptions profile;
  takt::command::DoubleOptions device_double;
  takt::command::ReplayOptions replay;
  takt::command::LogOptions log;
  std::string type;
  bool check_json = false;
  bool devices_json = false;
  takt::command::CaptureOptions capture;
  int exit_code = 0;
  const takt::Registry registry = takt::ace_registry();

  add_run(app, registry, run_options, exit_code);
  CLI::App* check = app.add_subcommand("check", "checks a graph and its schedule without running them");
  add_load_options(*check, check_options.graph, check_options.load);
  add_overlay_option(*check, check_options.load);
  check->add_flag("--json", check_json, "prints the result as JSON");
  check->callback([&] { exit_code = takt::command::check_graph(registry, check_options, check_json); });
  add_show(app, registry, show_options, exit_code);
  add_report(app, registry, render_options, exit_code);
  add_explain(app, explain_options, exit_code);
  CLI::App* nodes =
      app.add_subcommand("nodes", "lists node types and device kinds, or one with its ports and parameters");
  nodes->add_option("type", type, "node type");
  nodes->callback([&] { exit_code = takt::command::print_nodes(registry, type); });
  takt::command::add_attach_commands(app, registry, attach, exit_code);
  takt::command::add_robot(app, robot, exit_code);
  takt::command::add_doctor(app, doctor, exit_code);
  add_devices(app, devices_json, exit_code);
  add_capture(app, capture, exit_code);
  add_profile(app, registry, profile, exit_code);
  takt::command::add_replay(app, registry, replay, exit_code);
  takt::command::add_log(app, log, exit_code);
  takt::command::add_double(app, device_double, exit_code);
  for (const DeskCommand& command : kDeskCommands) app.add_subcommand(command.name, command.what);  // for the list only

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    exit_code = app.exit(error) == 0 ? 0 : takt::command::kBadInput;
  }
  return takt::command::with_output(exit_code);
}
