// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/reports.hpp"

#include <fmt/format.h>

namespace takt::semantic {
namespace {

/// The object's known states behind those of the others; how many there was room for.
size_t write_states(const SemanticMap& map, const Object& object, ObjectReports& out) {
  size_t count = 0;
  for (const State& state : std::span(object.states).first(object.state_count)) {
    ObjectAttribute said{};
    const size_t length =
        write_value(map.attribute(state.attribute), state.value, std::span(said.value, sizeof(said.value) - 1));
    if (length >= sizeof(said.value) || !set_text(map.network().name(state.attribute), said.name)) continue;
    if (!out.attributes.push_back(said)) break;
    ++count;
  }
  return count;
}

}  // namespace

std::string_view explain(const Report& report, Misfit misfit, const ObjectAttribute* attribute, uint64_t so_far,
                         std::span<char> into) {
  const auto write = [&]<class... T>(fmt::format_string<T...> form, T&&... values) -> std::string_view {
    const size_t wanted = fmt::format_to_n(into.data(), into.size(), form, std::forward<T>(values)...).size;
    return {into.data(), std::min(wanted, into.size())};
  };
  switch (misfit) {
    case Misfit::type: return write("left out a `{}`, no type of the network: {} such so far", report.type, so_far);
    case Misfit::place: return write("left out a {}, nowhere: {} such so far", report.type, so_far);
    case Misfit::attribute:
      return write("left out {} of a {}, no attribute of the network: {} such so far", text_in(attribute->name),
                   report.type, so_far);
    case Misfit::value: break;
  }
  return write("left out {} of a {}, `{}` is no value of it: {} such so far", text_in(attribute->name), report.type,
               text_in(attribute->value), so_far);
}

void write_reports(const SemanticMap& map, ObjectReports& out) {
  const Network& network = map.network();
  out.in_map = 1;
  for (NodeId node = 0; node < network.end(); ++node) {
    if (!network.exists(node) || network.kind(node) != Kind::object) continue;
    const auto types = network.omega(node, Kind::type);
    ObjectName name{};
    if (types.empty() || !set_text(network.name(node), name.name) || !set_text(network.name(types[0]), name.type))
      continue;
    if (!out.names.push_back(name)) return;
    const Object& object = map.object(node);
    out.places.push_back({static_cast<float>(object.x_m), static_cast<float>(object.y_m), 0, 0,
                          static_cast<float>(object.confidence), static_cast<float>(write_states(map, object, out))});
  }
}

}  // namespace takt::semantic
