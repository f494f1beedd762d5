// SPDX-License-Identifier: Apache-2.0
#include "graph/language/figure_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/language/quantity.hpp"
#include "graph/language/words.hpp"

namespace takt::graph {

using nlohmann::json;

std::optional<int64_t> read_duration(const Document& document, const std::string& pointer, std::string_view key,
                                     std::vector<Problem>& problems) {
  if (document.raw(pointer).empty()) return std::nullopt;
  const auto ns = parse_duration_ns(document.raw(pointer));
  if (ns) return *ns;
  problems.push_back({document.value_at(pointer), fmt::format("{} {}", ticked(key), ns.error())});
  return std::nullopt;
}

void FigureReader::read(const json& expect, FigureExpectations& figures) {
  read_modes(expect, figures);
  read_bounds(expect, "rates", names_.nodes, "nodes", &Bound::at_least, figures.rates);
  read_bounds(expect, "results", names_.nodes, "nodes", &Bound::at_least, figures.results);
  read_bounds(expect, "misses", names_.nodes, "nodes", &Bound::at_most, figures.misses);
  read_bounds(expect, "stale", names_.nodes, "nodes", &Bound::at_most, figures.stale);
  read_bounds(expect, "ages", names_.chains, "chains", &Bound::at_most, figures.ages);
}

void FigureReader::read_modes(const json& expect, FigureExpectations& figures) {
  const json modes = expect.value("modes", json::array());
  for (size_t i = 0; modes.is_array() && i < modes.size(); ++i) {
    if (!modes[i].is_string()) continue;
    const auto mode = modes[i].get<std::string>();
    if (std::find(names_.modes.begin(), names_.modes.end(), mode) == names_.modes.end())
      problem(document_.value_at(child("/expect/modes", i)),
              fmt::format("graph {} has no mode {}{}", ticked(names_.graph), ticked(mode),
                          alternatives(mode, names_.modes)));
    figures.modes.push_back(mode);
  }
}

void FigureReader::read_bounds(const json& expect, const char* name, const std::vector<std::string>& valid,
                               const char* what, std::optional<double> Bound::*bare,
                               std::map<std::string, Bound>& bounds) {
  const json map = expect.value(name, json::object());
  if (!map.is_object()) return;
  const std::string pointer = child("/expect", name);
  for (const auto& [id, value] : map.items()) {
    const std::string below = child(pointer, id);
    if (std::find(valid.begin(), valid.end(), id) == valid.end())
      problem(document_.key_at(below), fmt::format("{} names {}, but it is none of the {} of graph {}{}", ticked(name),
                                                   ticked(id), what, ticked(names_.graph), alternatives(id, valid)));
    bounds[id] = read_bound(value, below, bare, std::string_view(name) == "ages");
  }
}

Bound FigureReader::read_bound(const json& value, const std::string& pointer, std::optional<double> Bound::*bare,
                               bool time) {
  const auto figure = [&](const json& holder, const std::string& place,
                          const std::string& key) -> std::optional<double> {
    if (!time) return holder.is_number() ? std::optional(holder.get<double>()) : std::nullopt;
    const auto ns = read_duration(document_, place, key, problems_);
    return ns ? std::optional(static_cast<double>(*ns)) : std::nullopt;
  };
  Bound bound;
  if (value.is_object()) {
    if (value.contains("at_least")) bound.at_least = figure(value["at_least"], child(pointer, "at_least"), "at_least");
    if (value.contains("at_most")) bound.at_most = figure(value["at_most"], child(pointer, "at_most"), "at_most");
    if (value.empty()) problem(document_.value_at(pointer), "lacks at_least, at_most or both");
    return bound;
  }
  const auto alone = figure(value, pointer, pointer.substr(pointer.rfind('/') + 1));
  if (bare == nullptr) bound.at_least = bound.at_most = alone;
  else bound.*bare = alone;
  return bound;
}

}  // namespace takt::graph
