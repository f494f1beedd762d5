// SPDX-License-Identifier: Apache-2.0
#include "graph/view/html_report.hpp"

#include <fmt/format.h>

#include "graph/view/graph_pictures.hpp"
#include "graph/view/html_parts.hpp"
#include "graph/view/markup.hpp"

namespace takt::view {

std::string html_report(const Registry& registry, const nlohmann::ordered_json& report, const graph::GraphSpec& graph,
                        const std::filesystem::path& output) {
  const std::string picture = graph_svg(make_diagram(graph, registry));
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{} - run report</title>\n"
      "<style>{}</style>\n</head>\n<body>\n",
      escape(graph.name), page_style());
  page += head_section(report, graph);
  page += nodes_section(report);
  page += chains_section(report, graph);
  page += section("Graph", "<div class=\"scroll\">\n" + picture + "</div>\n");
  page += timeline_section(report, graph);
  page += histograms_section(report);
  page += edges_section(report);
  page += cpu_section(report);
  page += memory_section(report);
  page += images_section(output);
  return page + "</body>\n</html>\n";
}

}  // namespace takt::view
