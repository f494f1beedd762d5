// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/network_text.hpp"

#include <fmt/format.h>

namespace takt::semantic {
namespace {

constexpr Kind kAllKinds[] = {Kind::object, Kind::attribute, Kind::type, Kind::action};

std::string_view relation(Kind a, Kind b) {
  const auto is = [&](Kind p, Kind q) { return (a == p && b == q) || (a == q && b == p); };
  if (is(Kind::object, Kind::type)) return "is of type";
  if (is(Kind::type, Kind::action)) return "has action";
  if (is(Kind::attribute, Kind::action)) return "affects";
  return "has attribute";
}

std::string states_of(const SemanticMap& map, NodeId node, const char* separator) {
  const Object& object = map.object(node);
  std::string text;
  for (uint32_t i = 0; i < object.state_count; ++i) {
    const State& s = object.states[i];
    text += fmt::format("{}{}={}", i > 0 ? separator : "", map.network().name(s.attribute),
                        to_text(map.attribute(s.attribute), s.value));
  }
  return text;
}

/// visit(a, b) once for each connection, a < b.
template <class Visit>
void each_link(const Network& network, NodeId a, Visit visit) {
  for (const Kind kind : kAllKinds)
    for (const NodeId b : network.omega(a, kind))
      if (a < b) visit(b);
}

std::string replaced(std::string_view text, std::initializer_list<std::pair<char, const char*>> escapes) {
  std::string out;
  for (const char c : text) {
    const char* escape = nullptr;
    for (const auto& [from, to] : escapes)
      if (c == from) escape = to;
    if (escape) out += escape;
    else out += c;
  }
  return out;
}
std::string quoted(std::string_view text) { return replaced(text, {{'"', "\\\""}, {'\\', "\\\\"}}); }
std::string xml(std::string_view text) {
  return replaced(text, {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}});
}

}  // namespace

std::string to_dot(const SemanticMap& map) {
  constexpr const char* kShapes[] = {"ellipse", "note", "box", "hexagon"};
  const Network& network = map.network();
  std::string text = "graph semantic_network {\n";
  for (const Kind kind : kAllKinds)
    for (const NodeId node : map.all(kind)) {
      const std::string states = kind == Kind::object ? states_of(map, node, "\\n") : "";
      text += fmt::format("  n{} [label=\"{}{}{}\", shape={}];\n", node, quoted(network.name(node)),
                          states.empty() ? "" : "\\n", states, kShapes[static_cast<size_t>(kind)]);
    }
  for (const Kind kind : kAllKinds)
    for (const NodeId a : map.all(kind))
      each_link(network, a, [&](NodeId b) {
        text += fmt::format("  n{} -- n{} [label=\"{}\"];\n", a, b, relation(kind, network.kind(b)));
      });
  return text + "}\n";
}

std::string to_graphml(const SemanticMap& map) {
  const Network& network = map.network();
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<graphml xmlns=\"http://graphml.graphdrawing.org/xmlns\">\n"
      "  <key id=\"name\" for=\"node\" attr.name=\"name\" attr.type=\"string\"/>\n"
      "  <key id=\"kind\" for=\"node\" attr.name=\"kind\" attr.type=\"string\"/>\n"
      "  <key id=\"x\" for=\"node\" attr.name=\"x\" attr.type=\"double\"/>\n"
      "  <key id=\"y\" for=\"node\" attr.name=\"y\" attr.type=\"double\"/>\n"
      "  <key id=\"states\" for=\"node\" attr.name=\"states\" attr.type=\"string\"/>\n"
      "  <key id=\"relation\" for=\"edge\" attr.name=\"relation\" attr.type=\"string\"/>\n"
      "  <graph edgedefault=\"undirected\">\n";
  for (const Kind kind : kAllKinds)
    for (const NodeId node : map.all(kind)) {
      text += fmt::format("    <node id=\"n{}\"><data key=\"name\">{}</data><data key=\"kind\">{}</data>", node,
                          xml(network.name(node)), to_string(kind));
      if (kind == Kind::object)
        text += fmt::format("<data key=\"x\">{}</data><data key=\"y\">{}</data><data key=\"states\">{}</data>",
                            map.object(node).x_m, map.object(node).y_m, xml(states_of(map, node, ", ")));
      text += "</node>\n";
    }
  for (const Kind kind : kAllKinds)
    for (const NodeId a : map.all(kind))
      each_link(network, a, [&](NodeId b) {
        text += fmt::format("    <edge source=\"n{}\" target=\"n{}\"><data key=\"relation\">{}</data></edge>\n", a, b,
                            relation(kind, network.kind(b)));
      });
  return text + "  </graph>\n</graphml>\n";
}

}  // namespace takt::semantic
