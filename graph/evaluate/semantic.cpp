// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "graph/evaluate/percent.hpp"
#include "hal/settings/json.hpp"
#include "nodes/planner/planner.hpp"
#include "nodes/semantic/evaluate.hpp"
#include "nodes/semantic/network_file.hpp"
#include "nodes/semantic/network_text.hpp"
#include "rt/file/output_file.hpp"
#include "rt/quantile.hpp"

namespace takt::command {
namespace {

using namespace semantic;
using Json = nlohmann::ordered_json;

constexpr double kMergeMin[] = {0.55, 0.65, 0.75, 0.85, 0.95};
constexpr double kDistanceMax_m[] = {0.5, 1, 1.5, 2, 3, 4};

RoomParameters room_of(const EvalSemanticOptions& o) {
  RoomParameters room;
  room.objects = o.objects;
  room.looks = o.looks;
  room.noise_m = o.noise_m;
  return room;
}

InsertionParameters insertion_of(const EvalSemanticOptions& o) {
  InsertionParameters p;
  p.merge_min = o.merge_min;
  p.similarity.distance_max_m = o.distance_max_m;
  return p;
}

Json to_json(const RoomFigures& f) {
  return {{"seen", f.seen},
          {"found_pct", percent(f.found, f.seen)},
          {"duplicates", f.duplicates},
          {"swallowed", f.swallowed},
          {"sightings", f.sightings},
          {"false_merges_pct", percent(f.false_merges, f.sightings)},
          {"position_error_m", quantile(f.position_m, 0.5)},
          {"position_error_m_p95", quantile(f.position_m, 0.95)},
          {"vanished", f.vanished},
          {"removed", f.removed},
          {"wrongly_removed", f.wrongly_removed}};
}

void print_head(const char* what) {
  std::printf("%-30s %6s %8s %11s %10s %14s %8s %8s %9s %8s\n", what, "seen", "found %", "duplicates", "swallowed",
              "false merges %", "m p50", "m p95", "removed", "wrongly");
}
void print_row(const std::string& name, const RoomFigures& f) {
  std::printf("%-30s %6zu %8.1f %11zu %10zu %14.2f %8.3f %8.3f %4zu/%-4zu %8zu\n", name.c_str(), f.seen,
              percent(f.found, f.seen), f.duplicates, f.swallowed, percent(f.false_merges, f.sightings),
              quantile(f.position_m, 0.5), quantile(f.position_m, 0.95), f.removed, f.vanished, f.wrongly_removed);
}

int compare(const EvalSemanticOptions& o) {
  InsertionParameters p = insertion_of(o), distinct = p;
  distinct.distinct_in_view = true;
  const RoomParameters room = room_of(o);
  const RoomFigures thesis = measure_rooms(room, p, o.seed, o.rooms),
                    apart = measure_rooms(room, distinct, o.seed, o.rooms),
                    places = measure_rooms(room, p, o.seed, o.rooms, false);
  if (o.json) {
    Json out = to_json(thesis);
    out["distinct_in_view"] = to_json(apart);
    out["baseline"] = to_json(places);
    out["baseline"]["name"] = "places and types alone";
    out["seed"] = o.seed;
    std::printf("%s\n", out.dump(2).c_str());
    return kOk;
  }
  std::printf("%zu rooms of %zu objects, %zu looks each, noise %.2f m, p_min %.2f, d_max %.1f m\n", o.rooms, o.objects,
              o.looks, o.noise_m, o.merge_min, o.distance_max_m);
  print_head("insertion");
  print_row("as the thesis", thesis);
  print_row("objects of one view are two", apart);
  print_row("places and types alone", places);
  return kOk;
}

int sweep(const EvalSemanticOptions& o) {
  Json rows = Json::array();
  EvalSemanticOptions at = o;
  if (!o.json) print_head("p_min, d_max");
  for (const double merge_min : kMergeMin)
    for (const double distance_max_m : kDistanceMax_m) {
      at.merge_min = merge_min;
      at.distance_max_m = distance_max_m;
      const RoomFigures f = measure_rooms(room_of(at), insertion_of(at), o.seed, o.rooms);
      rows.push_back(to_json(f));
      rows.back()["p_min"] = merge_min;
      rows.back()["d_max_m"] = distance_max_m;
      if (!o.json) print_row(fmt::format("{:.2f}, {:.1f} m", merge_min, distance_max_m), f);
    }
  if (o.json) std::printf("%s\n", Json{{"seed", o.seed}, {"noise_m", o.noise_m}, {"sweep", rows}}.dump(2).c_str());
  return kOk;
}

/// One room, each decision in a line.
int tell(const EvalSemanticOptions& o) {
  const InsertionParameters p = insertion_of(o);
  measure_room(room_of(o), p, o.seed, true, [&](const SemanticMap& map, const Decision& decision) {
    char text[kLongestReason];
    const std::string_view why = explain(map, decision, p, text);
    std::printf("%.*s\n", static_cast<int>(why.size()), why.data());
  });
  return kOk;
}

// A network from a file ----------------------------------------------------------------------------------------------

void write(const std::filesystem::path& file, const std::string& text) {
  if (!file.empty()) require_written(write_file(file, text));
}

/// "cup_1.level=full".
planner::Goal parse_goal(const SemanticMap& map, const std::string& text) {
  const size_t dot = text.find('.'), equals = text.find('=', dot == std::string::npos ? 0 : dot);
  if (dot == std::string::npos || equals == std::string::npos)
    throw std::invalid_argument(
        fmt::format("--goal {}: write OBJECT.ATTRIBUTE=VALUE, for instance cup_1.level=full", text));
  const auto node = [&](const std::string& name, Kind kind) {
    const NodeId found = map.network().find(name);
    if (found != kNoNode && map.network().kind(found) == kind) return found;
    std::vector<std::string_view> names;
    for (const NodeId other : map.all(kind)) names.push_back(map.network().name(other));
    throw std::invalid_argument(fmt::format("--goal {}: there is no {} `{}`; valid are: {}", text, to_string(kind),
                                            name, fmt::join(names, ", ")));
  };
  const NodeId object = node(text.substr(0, dot), Kind::object),
               attribute = node(text.substr(dot + 1, equals - dot - 1), Kind::attribute);
  const auto value = parse_value(map.attribute(attribute), text.substr(equals + 1));
  if (!value) throw std::invalid_argument(fmt::format("--goal {}: {}", text, value.error()));
  return {object, attribute, *value};
}

int show_network(const EvalSemanticOptions& o) {
  SemanticMap map({});
  if (const auto read = read_network(o.network, map); !read)
    throw std::invalid_argument(fmt::format("{}", fmt::join(read.error(), "\n")));
  write(o.dot, to_dot(map));
  write(o.graphml, to_graphml(map));
  Json out;
  for (const Kind kind : {Kind::object, Kind::attribute, Kind::type, Kind::action})
    out[std::string(to_string(kind)) + "s"] = map.all(kind).size();
  std::string text = fmt::format("{} nodes", map.network().size());
  if (!o.goals.empty()) {
    std::vector<planner::Goal> goals;
    for (const std::string& goal : o.goals) goals.push_back(parse_goal(map, goal));
    const auto domain = planner::ground(map, goals, {o.at[0], o.at[1]}, {});
    if (!domain) throw std::invalid_argument(domain.error());
    planner::PlannerParameters p;
    if (o.recursive) p.method = planner::Method::recursive;
    const planner::Plan plan = planner::Planner(p).plan(*domain);
    text = planner::to_text(map, *domain, plan);
    out["cost_s"] = static_cast<double>(plan.cost_ns) * 1e-9;
    out["steps"] = plan.steps.size();
    out["expanded"] = plan.expanded;
    out["plan"] = text;
  }
  std::printf("%s\n", o.json ? out.dump(2).c_str() : text.c_str());
  return kOk;
}

}  // namespace

int evaluate(const EvalSemanticOptions& o) {
  if (!o.network.empty()) return show_network(o);
  return o.tell ? tell(o) : o.sweep ? sweep(o) : compare(o);
}

}  // namespace takt::command
