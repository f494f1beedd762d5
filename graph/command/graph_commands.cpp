// SPDX-License-Identifier: Apache-2.0
#include "graph/command/graph_commands.hpp"

#include <filesystem>
#include <functional>

#include "graph/cli/file_option.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/set_option.hpp"
#include "graph/command/bringup_command.hpp"
#include "graph/command/check_command.hpp"
#include "graph/language/overlay.hpp"

namespace takt::command {
void add_load_options(CLI::App& app, std::filesystem::path& graph, graph::LoadOptions& load) {
  reads_file(app.add_option("graph", graph, "graph file (default graph/ace.yaml)"));
  app.add_option("--profile", load.profile, "sim | replay | robot, as the graph defines them");
  reads_file(app.add_option("--schedule", load.schedule, "schedule file instead of the graph's"));
  app.add_option("--policy", load.policy, "deadline | fixed | cooperative instead of the schedule's");
  app.add_option("--machine", load.machine,
                 "the part of the graph that this machine of its `machines` runs (default: all)");
  app.add_option("--mode", load.mode, "a mode of the graph (default full)");
  reads_file(
      app.add_option("--params", load.params, "parameter file of this robot: constants, parameters, device settings"));
  app.add_option("--set", load.set, "node.param=value, repeatable");
  add_plugin_option(app, load.plugin_files);
}

namespace {

/// For what runs or judges a graph as it will run: with the values that `takt set --keep` left for it.
void add_overlay_option(CLI::App& app, graph::LoadOptions& load) {
  load.state = graph::state_folder();
  app.add_flag_callback(
      "--no-overlay", [&load] { load.state.clear(); }, "without the values that `takt set --keep` left for the graph");
}

void add_show(CLI::App& app, plugin::Plugins& plugins, ShowOptions& o, int& exit_code) {
  CLI::App* show = app.add_subcommand("show", "draws a graph, or lists what each node reads");
  add_load_options(*show, o.graph, o.load);
  CLI::Option* svg = writes_file(show->add_option("--svg", o.svg, "writes the picture as an SVG file"));
  show->add_flag("--dot", o.dot, "prints Graphviz text")->excludes(svg);
  show->footer("Example: takt show graph/ace.yaml --svg ace.svg");
  show->callback([&] {
    exit_code =
        plugins.carry_out(graph_file(o.graph), o.load, [&](const Registry& known) { return show_graph(known, o); });
  });
}

void add_report(CLI::App& app, plugin::Plugins& plugins, RenderOptions& o, int& exit_code) {
  CLI::App* report = app.add_subcommand("report", "makes a page for people from the report of a run");
  reads_file(report->add_option("report", o.report, "what `takt run --report` wrote"))->required();
  reads_file(report->add_option("graph", o.graph, "graph file of the run (default graph/ace.yaml)"));
  reads_file(report->add_option("--schedule", o.schedule, "schedule file of the run, if it was not the graph's"));
  writes_file(report->add_option("--html", o.html, "writes the page to this file"))->required();
  reads_folder(report->add_option("--output", o.output, "folder with the pictures of the run (default out)"));
  report->footer("Example: takt report run.json graph/ace.yaml --html run.html");
  report->callback([&] {
    graph::LoadOptions load;
    exit_code =
        plugins.carry_out(graph_file(o.graph), load, [&](const Registry& known) { return render_report(known, o); });
  });
}

void add_explain(CLI::App& app, ExplainOptions& o, int& exit_code) {
  CLI::App* explain = app.add_subcommand("explain", "says why jobs missed their deadlines, one sentence each");
  reads_file(explain->add_option("file", o.file, "what `takt run --trace` wrote (or --report, which says less)"))
      ->required();
  explain->add_option("node", o.node, "only this node");
  writes_file(explain->add_option("--svg", o.svg, "draws the largest of the misses printed"));
  explain->footer("Example: takt explain trace.json");
  explain->callback([&] { exit_code = explain_misses(o); });
}

void add_check(CLI::App& app, plugin::Plugins& plugins, RunOptions& o, bool& json, int& exit_code) {
  CLI::App* check = app.add_subcommand("check", "checks a graph and its schedule without running them");
  add_load_options(*check, o.graph, o.load);
  add_overlay_option(*check, o.load);
  check->add_flag("--json", json, "prints the result as JSON");
  check->footer(
      "Example: takt check graph/ace.yaml --policy fixed\n"
      "Of every mode: response bounds and margins, age bounds of chains, memory; of a refused schedule the smallest\n"
      "change that makes it fit. Exit 0: admitted, 1: infeasible or not proven, 2: invalid.");
  check->callback([&] {
    exit_code = plugins.carry_out(graph_file(o.graph), o.load,
                                  [&](const Registry& known) { return check_graph(known, o, json); });
  });
}

void add_nodes(CLI::App& app, plugin::Plugins& plugins, NodesOptions& o, int& exit_code) {
  CLI::App* nodes =
      app.add_subcommand("nodes", "lists node types and device kinds, or one with its ports and parameters");
  nodes->add_option("type", o.type, "node type");
  add_plugin_option(*nodes, o.load.plugin_files);
  nodes->footer("Example: takt nodes stereo");
  nodes->callback([&] {
    exit_code = plugins.carry_out({}, o.load, [&](const Registry& known) { return print_nodes(known, o.type); });
  });
}

void add_run(CLI::App& app, plugin::Plugins& plugins, RunOptions& o, int& exit_code) {
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
  writes_file(run->add_option("--report", o.report, "writes the report as JSON"));
  writes_file(run->add_option("--html", o.html, "writes the report as one page to be read offline"));
  writes_file(run->add_option("--junit", o.junit, "writes the verdict as JUnit XML, for CI servers"));
  writes_file(run->add_option("--trace", o.trace, "writes a trace for https://ui.perfetto.dev and `takt explain`"));
  run->add_option("--trace-source", o.trace_source,
                  "how preemption is seen: auto (the best granted) | tracefs | perf | none")
      ->check(CLI::IsMember({"auto", "tracefs", "perf", "none"}));
  writes_file(run->add_option("--record", o.record, "writes an MCAP record for `takt replay` and `takt log`"));
  run->add_option("--record-port", o.record_ports,
                  "NODE.PORT (or all): its messages whole, as those of devices and small ones are; repeatable");
  run->add_option("--ring", o.ring,
                  "on | off: keeps the newest part of the run in OUTPUT/flight, frozen by misses, losses and marks "
                  "(default: on in real time)")
      ->check(CLI::IsMember({"auto", "on", "off"}));
  run->add_flag("--web", o.web,
                "shows the run in a browser and to Foxglove: `takt web` beside it, as the graph's `web` says");
  reads_file(run->add_option("--faults", o.faults,
                             "a scenario: injects its faults and exits 0 exactly if what it expects is met"));
  reads_folder(run->add_option(
      "--keys", o.keys, "keys of this machine (`takt keys`): only machines with keys of the same graph are heard"));
  writes_folder(run->add_option("--output", o.output, "folder for pictures and other results (default out)"));
  run->add_option("--seed", o.seed, "seed of the simulated world");
  run->add_option("--watchdog", o.watchdog,
                  "device (/dev/watchdog) that resets the machine unless all high-criticality nodes are well");
  run->add_option("--watchdog-timeout", o.watchdog_timeout_s, "seconds until it does (default 10)")
      ->check(CLI::Range(1, 3600));
  run->add_flag("--unchecked", o.unchecked, "runs what the check refuses");
  run->add_flag("--require-rt", o.require_rt,
                "exit 3 where the machine lacks what `takt doctor` checks for such a run");
  run->add_flag("--brought-up", o.brought_up,
                "exit 2 if a real base would drive and something of the robot was not tried with `takt bringup`");
  run->footer(
      "Example: takt run graph/kitti.yaml --html run.html\n"
      "Example: takt run --clock virtual --record run.mcap\n"
      "Where the kernel refuses a policy that only the schedule asks for, the run falls back to `cooperative` and says "
      "so.\n"
      "A policy from the command line ends with exit 3 instead.");
  run->callback([&, how_long] {
    o.duration_asked = how_long->count() > 0;
    exit_code = plugins.supervise(graph_file(o.graph), o.load, [&](const Registry& known) {
      const int code = o.brought_up ? may_drive(known, o) : int{kOk};
      return code == kOk ? run_graph(known, o) : code;
    });
  });
}

void add_profile(CLI::App& app, plugin::Plugins& plugins, ProfileOptions& o, int& exit_code) {
  CLI::App* profile = app.add_subcommand("profile", "measures execution times and writes budgets into a schedule");
  add_load_options(*profile, o.run.graph, o.run.load);
  add_overlay_option(*profile, o.run.load);
  profile->add_option("--for", o.run.duration_s, "how long each of the two passes lasts, e.g. 20s")
      ->transform(CLI::Validator(duration, "DURATION"));
  profile->add_option("--seed", o.run.seed, "seed of the simulated world");
  profile->add_option("--quantile", o.quantile, "of the execution times (default 0.99)")->check(CLI::Range(0.01, 1.0));
  profile->add_option("--margin", o.margin, "budget = margin x quantile (default 1.2)")->check(CLI::Range(0.1, 100.0));
  CLI::Option* write =
      writes_file(profile->add_option("--write", o.write, "writes the schedule with the budgets to this file"));
  CLI::Option* in_place = profile->add_flag("--in-place", o.in_place, "writes them into the schedule itself");
  CLI::Option* compare =
      reads_file(profile->add_option("--compare", o.compare, "compares with this schedule: exit 1 if above"));
  CLI::Option* keep =
      profile->add_flag("--keep-budgets", o.keep_budgets, "writes what was measured, and leaves budgets");
  profile->add_option("--tolerance", o.tolerance, "by how much a node may be above (default 20%)")->needs(compare);
  in_place->excludes(write)->excludes(compare);
  write->excludes(compare);
  keep->excludes(compare);
  profile->footer(
      "Example: takt profile graph/ace.yaml --write measured.yaml\n"
      "Example: takt profile --compare schedules/thesis.yaml");
  profile->callback([&] {
    exit_code = plugins.carry_out(graph_file(o.run.graph), o.run.load,
                                  [&](const Registry& known) { return profile_graph(known, o); });
  });
}

}  // namespace

void add_plugin_option(CLI::App& app, std::vector<std::filesystem::path>& files) {
  // Also one of the plug-in folder of the installation: whether it can be read is seen when it is found.
  app.add_option("--plugin", files, "shared module with node types, devices or messages, repeatable")
      ->type_name("FILE");
}

void add_graph_commands(CLI::App& app, plugin::Plugins& plugins, GraphOptions& o, int& exit_code) {
  add_run(app, plugins, o.run, exit_code);
  add_check(app, plugins, o.check, o.check_json, exit_code);
  add_show(app, plugins, o.show, exit_code);
  add_report(app, plugins, o.render, exit_code);
  add_explain(app, o.explain, exit_code);
  add_nodes(app, plugins, o.nodes, exit_code);
  add_profile(app, plugins, o.profile, exit_code);
}

}  // namespace takt::command
