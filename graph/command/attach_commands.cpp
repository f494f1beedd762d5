// SPDX-License-Identifier: Apache-2.0
#include "graph/command/attach_commands.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "graph/attach/endpoint.hpp"
#include "graph/attach/parameters.hpp"
#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/command/top/show.hpp"
#include "graph/language/overlay.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto kRefresh = std::chrono::milliseconds(500);
constexpr size_t kFrozenShown = 3;

/// Throws Json::exception for an answer that is none, as a run of another version may give.
std::string top_text(const Json& top) {
  std::string text = fmt::format("{} ({} profile, {} transport), running {:.0f} s\n",
                                 top.at("graph").get<std::string>(), top.at("profile").get<std::string>(),
                                 top.at("transport").get<std::string>(), top.at("running_s").get<double>());
  const Json frozen = top.value("frozen", Json::array());
  for (size_t i = frozen.size() - std::min<size_t>(frozen.size(), kFrozenShown); i < frozen.size(); ++i)
    text += "frozen: " + frozen[i].get<std::string>() + "\n";
  for (const Json& parameter : top.value("parameters", Json::array())) text += attach::parameter_text(parameter) + "\n";
  text += fmt::format("{:<18} {:>5} {:>10} {:>7} {:>7} {:>7} {:>8} {:>8}\n", "node", "Hz", "completed", "missed",
                      "skipped", "paused", "CPU ms", "resp ms");
  for (const Json& node : top.at("nodes")) {
    const auto count = [&](const char* key) { return node.at(key).get<uint64_t>(); };
    const Json& rate = node.at("rate_hz");
    text += fmt::format(
        "{:<18} {:>5} {:>10} {:>7} {:>7} {:>7} {:>8.2f} {:>8.2f}\n", node.at("name").get<std::string>().substr(0, 18),
        rate.is_null() ? "on" : fmt::format("{:g}", rate.get<double>()), count("completed"), count("deadline_misses"),
        count("skipped"), count("paused"), node.at("exec_ms").get<double>(), node.at("response_ms").get<double>());
  }
  return text;
}

Json to_machine(const AttachOptions& options, Json question) {
  if (!options.machine.empty()) question["machine"] = options.machine;
  return question;
}

int run_top(const AttachOptions& options) {
  auto connection = attached(options.run);
  if (!connection) return kDeviceOrSystem;
  if (isatty(STDOUT_FILENO) != 0 && !options.once && !options.json && options.machine.empty())
    return top::show(std::move(*connection));
  for (bool first = true;; first = false) {
    if (!connection->write(to_machine(options, {{"do", "top"}}))) return kOk;  // the run has ended, as runs do
    const auto line = connection->read_line();
    if (!line) return first ? refuse("the run does not answer", kDeviceOrSystem) : kOk;
    if (line->contains("error")) return refuse(line->at("error").get<std::string>(), kBadInput);
    std::fputs(options.json ? (line->dump() + "\n").c_str() : top_text(*line).c_str(), stdout);
    std::fflush(stdout);
    if (options.once || output_gone()) return kOk;
    std::this_thread::sleep_for(kRefresh);
  }
}

int run_echo(const AttachOptions& options) {
  auto connection = attached(options.run);
  if (!connection) return kDeviceOrSystem;
  const std::string as = !options.png.empty() ? "png" : !options.ply.empty() ? "ply" : "";
  const std::filesystem::path& path = as == "png" ? options.png : options.ply;
  Json answer;
  int code = ask(*connection, {{"do", "echo"}, {"port", options.port}, {"as", as}, {"count", options.count}}, answer);
  for (int64_t shown = 0; code == kOk; ++shown) {
    const size_t bytes = answer.value("bytes", size_t{0});
    answer.erase("bytes");
    std::printf("%s\n", answer.dump(2).c_str());
    std::fflush(stdout);
    if (bytes > 0) {
      const auto file = connection->read_bytes(bytes);
      if (!file) return refuse("the run ended in the middle of a message", kDeviceOrSystem);
      if (const int code_of_file = write_output(path, *file, "--" + as); code_of_file != kOk) return code_of_file;
    }
    if (shown + 1 == options.count || output_gone()) return kOk;
    const auto line = connection->read_line();
    if (!line) return kOk;  // the run has ended
    answer = *line;
  }
  return code;
}

int run_question(const AttachOptions& options, const Json& question) {
  auto connection = attached(options.run);
  if (!connection) return kDeviceOrSystem;
  Json answer;
  int code = ask(*connection, to_machine(options, question), answer);
  const Json machines = answer.value("machines", Json::object());
  for (const auto& [machine, told] : machines.items())
    if (told.contains("error"))
      code = std::max(code, refuse(machine + ": " + told["error"].get<std::string>(), kDeviceOrSystem));
  return code;
}

int run_get(const AttachOptions& options) {
  auto connection = attached(options.run);
  if (!connection) return kDeviceOrSystem;
  Json answer;
  const int code = ask(*connection, to_machine(options, {{"do", "get"}, {"param", options.param}}), answer);
  if (code != kOk) return code;
  const Json& parameters = answer.at("parameters");
  if (options.json) std::printf("%s\n", parameters.dump(2).c_str());
  else if (parameters.empty()) std::puts("every parameter is as in the graph's file");
  else
    for (const Json& parameter : parameters) std::printf("%s\n", attach::parameter_text(parameter).c_str());
  return kOk;
}

/// NODE.PARAM, or each that TYPE:PARAM means in that graph.
std::vector<std::string> names_meant(const graph::GraphSpec& graph, const std::string& param) {
  const size_t colon = param.find(':');
  if (colon == std::string::npos) return {param};
  std::vector<std::string> names;
  for (const graph::NodeSpec& node : graph.nodes)
    if (node.type == param.substr(0, colon)) names.push_back(node.id + "." + param.substr(colon + 1));
  return names;
}

/// Changes the overlay of a graph that does not run. The graph judges the values, as it would judge --set.
int keep_for_later(const Registry& registry, const AttachOptions& options) {
  auto graph = load_graph(registry, options.graph, options.load);
  if (!graph) return kBadInput;
  const std::filesystem::path file = graph::overlay_file(graph::state_folder(), graph->name);
  if (options.forget) {
    const auto done = graph::forget_value(file, graph->name, options.param);
    if (!done) return refuse(done.error(), kBadInput);
    std::fprintf(stderr, "takt: nothing runs; %s is no longer in %s\n", options.param.c_str(), file.c_str());
    return kOk;
  }
  const std::vector<std::string> names = names_meant(*graph, options.param);
  if (names.empty()) return refuse(options.param + ": the graph has no node of that type", kBadInput);
  graph::LoadOptions with = options.load;
  graph::OverlayChanges changes;
  for (const std::string& name : names) {
    const bool node = std::any_of(graph->nodes.begin(), graph->nodes.end(),
                                  [&](const auto& spec) { return name.starts_with(spec.id + "."); });
    if (!node) return refuse(name + ": only parameters of nodes are kept (takt show lists the nodes)", kBadInput);
    with.set.push_back(name + "=" + options.value);
    changes[name] = options.value;
  }
  if (!load_graph(registry, options.graph, with)) return kBadInput;
  if (const auto done = graph::change_overlay(file, graph->name, changes); !done)
    return refuse(done.error(), kDeviceOrSystem);
  std::fprintf(stderr, "takt: nothing runs; kept in %s for the next run of %s\n", file.c_str(), graph->name.c_str());
  return kOk;
}

int run_set(plugin::Plugins& plugins, AttachOptions& options) {
  if ((options.keep || options.forget) && options.run == 0 && attach::running().empty())
    return plugins.carry_out(graph_file(options.graph), options.load,
                             [&](const Registry& known) { return keep_for_later(known, options); });
  auto connection = attached(options.run);
  if (!connection) return kDeviceOrSystem;
  const Json question =
      options.forget ? Json{{"do", "forget"}, {"param", options.param}}
                     : Json{{"do", "set"}, {"param", options.param}, {"value", options.value}, {"keep", options.keep}};
  Json answer;
  const int code = ask(*connection, to_machine(options, question), answer);
  if (answer.contains("kept")) std::fprintf(stderr, "takt: kept in %s\n", answer["kept"].get<std::string>().c_str());
  if (answer.contains("forgotten"))
    std::fprintf(stderr, "takt: taken out of %s; this run goes on with the value it has\n",
                 answer["forgotten"].get<std::string>().c_str());
  return code;
}

/// One line for each device.
std::string faults_text(const Json& devices) {
  std::string text = fmt::format("{:<18} {:<14} {}\n", "device", "on", "faults");
  for (const Json& device : devices)
    text +=
        fmt::format("{:<18} {:<14} {}\n", device.at("device").get<std::string>(), device.at("on").get<std::string>(),
                    fmt::join(device.at("faults").get<std::vector<std::string>>(), ", "));
  return text;
}

int run_fault(const AttachOptions& options) {
  auto connection = attached(options.run);
  if (!connection) return kDeviceOrSystem;
  Json question{{"do", "fault"}, {"device", options.device}};
  if (!options.fault.empty()) question.update({{"fault", options.fault}, {"on", options.on == "on"}});
  Json answer;
  const int code = ask(*connection, to_machine(options, question), answer);
  if (code != kOk || !options.fault.empty()) return code;
  const Json& devices = answer.at("devices");
  if (options.json) std::printf("%s\n", devices.dump(2).c_str());
  else if (devices.empty()) std::puts("no device of this run is simulated, so none has faults to switch");
  else std::fputs(faults_text(devices).c_str(), stdout);
  return kOk;
}

CLI::App* add(CLI::App& app, const char* name, const char* purpose, AttachOptions& o) {
  CLI::App* command = app.add_subcommand(name, purpose);
  command->add_option("--run", o.run, "process id of the run, where there are several");
  return command;
}

void for_a_machine(CLI::App* command, AttachOptions& o) {
  command->add_option("--machine", o.machine, "that of a graph on several; left out: the one that has it, or all");
}

}  // namespace

std::optional<attach::Connection> attached(int run) {
  const std::vector<int> runs = attach::running();
  if (run == 0 && runs.size() != 1) {
    if (runs.empty()) refuse("no graph of this user is running; start one with: takt run", kDeviceOrSystem);
    else
      refuse(fmt::format("several graphs are running; choose with --run: {}", fmt::join(runs, ", ")), kDeviceOrSystem);
    return std::nullopt;
  }
  const int pid = run != 0 ? run : runs.front();
  auto connection = attach::connect_to(pid);
  if (!connection)
    refuse(fmt::format("process {} is no running graph of this user (running: {})", pid, fmt::join(runs, ", ")),
           kDeviceOrSystem);
  return connection;
}

int ask(attach::Connection& connection, const Json& question, Json& answer) {
  if (!connection.write(question)) return refuse("the run has ended", kDeviceOrSystem);
  const auto line = connection.read_line();
  if (!line) return refuse("the run has ended, or does not answer", kDeviceOrSystem);
  answer = *line;
  return answer.contains("error") ? refuse(answer["error"].get<std::string>(), kBadInput) : kOk;
}

int understood(const std::function<int()>& command) {
  try {
    return command();
  } catch (const Json::exception& problem) {
    return refuse(
        fmt::format("the answer of the run is not understood ({}); use the takt that runs it", problem.what()),
        kDeviceOrSystem);
  }
}

void add_attach_commands(CLI::App& app, plugin::Plugins& plugins, AttachOptions& o, int& exit_code) {
  CLI::App* top = add(app, "top", "shows what a running graph does", o);
  top->add_flag("--once", o.once, "prints a table once");
  top->add_flag("--json", o.json, "one JSON object a line");
  top->footer(
      "Example: takt top\n"
      "In a terminal it has pages: nodes, chains, timeline, devices, processes, log, parameters. `?` lists the keys, q "
      "ends it.\n"
      "Elsewhere it prints a table every half second. NO_COLOR=1 takes the colours away.");
  top->callback([&] { exit_code = understood([&] { return run_top(o); }); });
  for_a_machine(top, o);
  CLI::App* echo = add(app, "echo", "shows messages of a running graph", o);
  echo->add_option("port", o.port, "NODE.PORT")->required();
  CLI::Option* png = writes_file(echo->add_option("--png", o.png, "writes the message as a picture"));
  writes_file(echo->add_option("--ply", o.ply, "writes the message, a point cloud, as a PLY file"))->excludes(png);
  echo->add_option("--count", o.count, "how many messages")->check(CLI::PositiveNumber);
  echo->footer("Example: takt echo stereo.disparity --png disparity.png");
  echo->callback([&] { exit_code = understood([&] { return run_echo(o); }); });
  CLI::App* get = add(app, "get", "shows a parameter of a running graph, or all that differ from its file", o);
  for_a_machine(get, o);
  get->add_option("param", o.param, "NODE.PARAM");
  get->add_flag("--json", o.json, "prints JSON");
  get->footer("Example: takt get obstacle_stop.deceleration");
  get->callback([&] { exit_code = understood([&] { return run_get(o); }); });
  CLI::App* set = add(app, "set", "sets a parameter of a running node, between two of its jobs", o);
  for_a_machine(set, o);
  set->add_option("param", o.param, "NODE.PARAM, or TYPE:PARAM for every node of that type")->required();
  CLI::Option* value = set->add_option("value", o.value, "with its unit");
  set->add_flag("--keep", o.keep, "also for later runs of the graph; without a running graph for these alone");
  CLI::Option* forget =
      set->add_flag("--forget", o.forget, "takes the value of NODE.PARAM out of those kept")->excludes(value);
  reads_file(set->add_option("--graph", o.graph, "where nothing runs: the graph file (default graph/ace.yaml)"));
  set->add_option("--profile", o.load.profile, "where nothing runs: the profile that the value must suit");
  set->footer(
      "Example: takt set --keep obstacle_stop.deceleration 0.8m/s2\n"
      "The value holds from the node's next job on, also after a restart of its process.");
  set->callback([&, value, forget] {
    if (value->count() + forget->count() == 0) throw CLI::RequiredError("value");
    exit_code = understood([&] { return run_set(plugins, o); });
  });
  CLI::App* fault = add(app, "fault", "switches a fault of a simulated device on or off, or lists the faults", o);
  for_a_machine(fault, o);
  fault->add_option("device", o.device, "device of the graph; left out: all are listed");
  CLI::Option* name = fault->add_option("fault", o.fault, "what goes wrong with it; left out: the device's are listed");
  CLI::Option* on = fault->add_option("on", o.on, "on or off")->check(CLI::IsMember({"on", "off"}));
  fault->add_flag("--json", o.json, "prints the list as JSON");
  fault->footer(
      "Example: takt fault front_laser silent on\n"
      "The fault holds from the device's next job on. A device has one at a time: another one takes its place.");
  fault->callback([&, name, on] {
    if (name->count() > on->count()) throw CLI::RequiredError("on or off");
    exit_code = understood([&] { return run_fault(o); });
  });
  CLI::App* mode = add(app, "mode", "changes the mode of a running graph", o);
  for_a_machine(mode, o);
  mode->add_option("mode", o.mode, "a mode of the graph, full or safe_stop")->required();
  mode->footer("Example: takt mode safe_stop");
  mode->callback([&] { exit_code = understood([&] { return run_question(o, {{"do", "mode"}, {"mode", o.mode}}); }); });
  CLI::App* mark = add(app, "mark", "sets a mark in what a running graph records, and freezes its ring", o);
  for_a_machine(mark, o);
  mark->add_option("words", o.words, "what happened")->required();
  mark->footer("Example: takt mark \"it turned left into the door\"");
  mark->callback([&] {
    exit_code = understood([&] { return run_question(o, {{"do", "mark"}, {"words", o.words}}); });
  });
  CLI::App* stop = add(app, "stop", "ends a running graph cleanly", o);
  for_a_machine(stop, o);
  stop->footer("Example: takt stop");
  stop->callback([&] { exit_code = understood([&] { return run_question(o, {{"do", "stop"}}); }); });
}

}  // namespace takt::command
