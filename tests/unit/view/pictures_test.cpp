// SPDX-License-Identifier: Apache-2.0
#include <tinyxml2.h>

#include <algorithm>
#include <functional>
#include <set>
#include <sstream>

#include "fixture.hpp"
#include "graph/ace/ace_registry.hpp"
#include "graph/view/graph_pictures.hpp"
#include "graph/view/markup.hpp"
#include "tests/graph_folder.hpp"

using namespace takt;
using namespace takt::view;

namespace {

/// Every element of a well-formed document.
std::vector<const tinyxml2::XMLElement*> elements(tinyxml2::XMLDocument& document, const std::string& text) {
  REQUIRE(document.Parse(text.c_str(), text.size()) == tinyxml2::XML_SUCCESS);
  std::vector<const tinyxml2::XMLElement*> all;
  const std::function<void(const tinyxml2::XMLElement*)> visit = [&](const tinyxml2::XMLElement* element) {
    all.push_back(element);
    for (auto* child = element->FirstChildElement(); child != nullptr; child = child->NextSiblingElement())
      visit(child);
  };
  visit(document.RootElement());
  return all;
}

std::string attribute(const tinyxml2::XMLElement* element, const char* name) {
  const char* value = element->Attribute(name);
  return value != nullptr ? value : "";
}

std::multiset<std::string> values(const std::vector<const tinyxml2::XMLElement*>& all, const char* name) {
  std::multiset<std::string> found;
  for (const auto* element : all)
    if (element->Attribute(name) != nullptr) found.insert(element->Attribute(name));
  return found;
}

void check_frames_apart(const std::vector<const tinyxml2::XMLElement*>& all) {
  struct Frame {
    double x, y, right, bottom;
  };
  std::vector<Frame> frames;
  for (const auto* element : all)
    if (attribute(element, "class") == "frame") {
      const double x = element->DoubleAttribute("x"), y = element->DoubleAttribute("y");
      frames.push_back({x, y, x + element->DoubleAttribute("width"), y + element->DoubleAttribute("height")});
    }
  for (size_t a = 0; a < frames.size(); ++a)
    for (size_t b = 0; b < a; ++b)
      CHECK((frames[a].right <= frames[b].x || frames[b].right <= frames[a].x || frames[a].bottom <= frames[b].y ||
             frames[b].bottom <= frames[a].y));
}

size_t longest_line(const std::string& text) {
  std::istringstream lines(text);
  size_t longest = 0;
  for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size());
  return longest;
}

}  // namespace

TEST_CASE("The SVG of ACE is well-formed and shows each node, device, edge and chain") {
  const auto graph = test::load_ace();
  const std::string svg = graph_svg(test::ace_diagram());
  tinyxml2::XMLDocument document;
  const auto all = elements(document, svg);
  CHECK(attribute(all[0], "xmlns") == "http://www.w3.org/2000/svg");
  std::multiset<std::string> ids, edges;
  for (const auto& device : graph.devices) {
    ids.insert(device.id);
    for (const auto& edge : device.edges) edges.insert(device.id + "." + edge.input);
  }
  for (const auto& node : graph.nodes) {
    ids.insert(node.id);
    for (const auto& edge : node.edges) edges.insert(node.id + "." + edge.input);
  }
  CHECK(ids.size() >= 7);
  CHECK(values(all, "data-id") == ids);
  CHECK(values(all, "data-to") == edges);
  for (const auto& chain : graph.chains) CHECK(svg.find(chain.name + ": " + chain.from.text()) != std::string::npos);
  check_frames_apart(all);
  for (const auto& [id, entry] : graph.schedule.entries) {
    const std::string words = "budget " + time_text(entry.budget_ns);
    CAPTURE(id);
    CAPTURE(words);
    CHECK(svg.find(words) != std::string::npos);
  }
  for (const char* words : {"stereo, 15 Hz", "depth 4", "max_age 350 ms", "stereo_pair", "age at most 700 ms",
                            "criticality=\"high\"", "prefers-color-scheme: dark"}) {
    CAPTURE(words);
    CHECK(svg.find(words) != std::string::npos);
  }
  CHECK(svg.find("<script") == std::string::npos);
  CHECK(test::count(svg, "http") == 1);  // the name space; nothing is fetched
}

TEST_CASE("Texts are escaped in every picture") {
  Diagram diagram = test::random_diagram(2, 1, 2, 3);
  diagram.name = "a<b & \"c\"";
  diagram.rooms[1] = "<room>";
  for (auto& box : diagram.boxes) box.id += "<&'\">\x01\xff", box.type = "</g>";
  tinyxml2::XMLDocument document;
  const auto all = elements(document, graph_svg(diagram));
  const auto ids = values(all, "data-id");
  CHECK(ids.size() == diagram.boxes.size());
  CHECK(ids.contains("device_0<&'\">\xEF\xBF\xBD\xEF\xBF\xBD"));
  const std::string dot = graph_dot(diagram);
  CHECK(dot.find("digraph \"a<b & \\\"c\\\"\"") == 0);
}

TEST_CASE("escape keeps good UTF-8 and replaces what is none") {
  CHECK(escape("a<b>&\"'") == "a&lt;b&gt;&amp;&quot;&#39;");
  CHECK(escape("M\xC3\xBCnchen \xE2\x86\x92 \xF0\x9F\xA4\x96\n") == "M\xC3\xBCnchen \xE2\x86\x92 \xF0\x9F\xA4\x96\n");
  const std::string bad = "\xEF\xBF\xBD";
  for (const char* text : {"\xC3", "\x80", "\xC0", "\x1b"}) CHECK(escape(text) == bad);
  CHECK(escape("\xC0\xAF") == bad + bad);            // an overlong slash
  CHECK(escape("\xED\xA0\x80") == bad + bad + bad);  // half a surrogate pair
  CHECK(escape(std::string_view("\0", 1)) == bad);
}

TEST_CASE("Graphviz text has a cluster for each room and a line for each edge") {
  const Diagram diagram = test::ace_diagram();
  const std::string dot = graph_dot(diagram);
  for (size_t room = 0; room < diagram.rooms.size(); ++room)
    CHECK(dot.find("subgraph cluster_" + std::to_string(room)) != std::string::npos);
  CHECK(test::count(dot, " -> ") == diagram.edges.size() + diagram.chains.size());
  CHECK(test::count(dot, "{") == test::count(dot, "}"));
  CHECK(dot.find("\"stereo\" -> \"ego_motion\" [label=\"disparity\\nmax_age 350 ms\"]") != std::string::npos);
}

TEST_CASE("The listing fits 80 columns and names every edge") {
  const Diagram diagram = test::ace_diagram();
  const std::string text = graph_listing(diagram);
  CHECK(longest_line(text) <= 80);
  for (const auto& box : diagram.boxes) CHECK(text.find("\n  " + box.id + " ") != std::string::npos);
  for (const auto& edge : diagram.edges) CHECK(text.find("<- " + diagram.from_text(edge)) != std::string::npos);
  CHECK(text.find("head_camera.pair -> mapping_3d.obstacles, age at most 700 ms") != std::string::npos);
}

TEST_CASE("The listing wraps long ids") {
  Diagram diagram = test::random_diagram(5, 3, 9, 20);
  for (auto& box : diagram.boxes) {
    box.id += "_with_a_name_of_thirty_letters";
    box.type = "a_type_with_a_long_name_too";
    for (auto& input : box.inputs) input.name += "_that_is_long", input.max_age_ns = 150'000'000;
  }
  CHECK(longest_line(graph_listing(diagram)) <= 80);
}

TEST_CASE("What a mode leaves out is not drawn, and its edges neither") {
  graph::LoadOptions options;
  options.mode = "no_stereo";
  const auto loaded = graph::load(takt::test::graph_folder() / "ace.yaml", options, ace_registry());
  REQUIRE(loaded.graph);
  const Diagram diagram = make_diagram(*loaded.graph, ace_registry());
  CHECK(diagram.boxes.size() == loaded.graph->nodes.size() + loaded.graph->devices.size());
  for (const auto& box : diagram.boxes) CHECK(box.id != "stereo");
}

TEST_CASE("Times read as people write them") {
  CHECK(time_text(66'666'667) == "66.67 ms");
  CHECK(time_text(999'960'000) == "1000 ms");
  CHECK(time_text(1'500'000'000) == "1.5 s");
  CHECK(time_text(250'000) == "250 us");
}

TEST_CASE("A deadline that is not stated is one period of the node or of its producer") {
  graph::GraphSpec graph;
  graph::ScheduleEntry camera, follower, stated;
  camera.rate = Rate{10, 1};
  follower.on = graph::PortName{"camera", "pair"};
  follower.every = 3;
  stated.rate = Rate{10, 1};
  stated.deadline_ns = 5;
  graph.schedule.entries = {{"camera", camera}, {"follower", follower}, {"stated", stated}, {"free", {}}};
  CHECK(deadline_ns(graph, "camera") == 100'000'000);
  CHECK(deadline_ns(graph, "follower") == 300'000'000);
  CHECK(deadline_ns(graph, "stated") == 5);
  CHECK_FALSE(deadline_ns(graph, "free"));
  CHECK_FALSE(deadline_ns(graph, "none"));
}
