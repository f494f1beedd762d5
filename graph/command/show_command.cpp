// SPDX-License-Identifier: Apache-2.0
#include "graph/command/show_command.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>

#include "graph/explain/file_format.hpp"
#include "graph/run/prepare.hpp"
#include "graph/view/graph_pictures.hpp"
#include "graph/view/html_report.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

/// The report, or null after the reason was written to stderr.
Json read_report(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    refuse(fmt::format("{}: cannot be read; name a file that `takt run --report FILE` wrote", file.string()),
           kBadInput);
    return nullptr;
  }
  Json report = Json::parse(in, nullptr, false);
  if (const auto later = explain::later_format(report, explain::kReportFormat)) {
    refuse(fmt::format("{} {}", file.string(), *later), kBadInput);
    return nullptr;
  }
  const auto word = [&](const char* key) { return report.contains(key) && report[key].is_string(); };
  if (report.is_object() && word("graph") && word("schedule")) return report;
  refuse(fmt::format("{}: is no report of a run; name a file that `takt run --report FILE` wrote", file.string()),
         kBadInput);
  return nullptr;
}

/// How the graph was loaded for that run.
graph::LoadOptions load_options(const Json& report, const RenderOptions& options) {
  graph::LoadOptions load;
  load.schedule = options.schedule;
  if (report.contains("profile") && report["profile"].is_string()) load.profile = report["profile"];
  if (report.contains("modes") && report["modes"].is_array() && !report["modes"].empty() &&
      report["modes"][0].is_object() && report["modes"][0].contains("name") && report["modes"][0]["name"].is_string())
    load.mode = report["modes"][0]["name"];
  if (report.contains("policy_asked") && report["policy_asked"].is_string()) load.policy = report["policy_asked"];
  return load;
}

/// The report must be of this graph, or the page would show the wrong one.
int compare_names(const Json& report, const graph::GraphSpec& graph) {
  if (report["graph"] != graph.name)
    return refuse(
        fmt::format("the report is of graph {}, but {} is graph {}; name the file of graph {}",
                    report["graph"].get<std::string>(), graph.file, graph.name, report["graph"].get<std::string>()),
        kBadInput);
  if (report["schedule"] != graph.schedule.name)
    return refuse(fmt::format("the report is of schedule {}, but the graph names schedule {}; give its file with "
                              "--schedule",
                              report["schedule"].get<std::string>(), graph.schedule.name),
                  kBadInput);
  return kOk;
}

}  // namespace

int show_graph(const Registry& registry, const ShowOptions& options) {
  const auto graph = load_graph(registry, options.graph, options.load);
  if (!graph) return kBadInput;
  const view::Diagram diagram = view::make_diagram(*graph, registry);
  if (!options.svg.empty()) return write_output(options.svg, view::graph_svg(diagram), "--svg");
  std::fputs((options.dot ? view::graph_dot(diagram) : view::graph_listing(diagram)).c_str(), stdout);
  return kOk;
}

int render_report(const Registry& registry, const RenderOptions& options) {
  const Json report = read_report(options.report);
  if (report.is_null()) return kBadInput;
  const auto graph = load_graph(registry, options.graph, load_options(report, options));
  if (!graph) return kBadInput;
  if (const int code = compare_names(report, *graph); code != kOk) return code;
  return write_output(options.html, view::html_report(registry, report, *graph, options.output), "--html");
}

}  // namespace takt::command
