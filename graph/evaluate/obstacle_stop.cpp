// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "graph/ace/ace_registry.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "graph/evaluate/stop_trials.hpp"
#include "hal/settings/json.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

/// Trials of one distance and one way of walking.
struct Cell {
  int trials = 0;
  std::vector<double> impacts_m_s;
  int unavoidable = 0;  ///< of the contacts
  double least_gap_m = INFINITY;
  void add(const StopOutcome& outcome) {
    ++trials;
    if (outcome.contact) impacts_m_s.push_back(outcome.impact_m_s);
    unavoidable += outcome.contact && outcome.unavoidable;
    least_gap_m = std::min(least_gap_m, outcome.least_gap_m);
  }
};

struct Table {
  std::array<std::array<Cell, kWalks>, kDistances> cells;
  uint64_t chain_misses = 0, vision_misses = 0;
  int far_contacts() const {
    return far_sum([](const Cell& cell) { return static_cast<int>(cell.impacts_m_s.size()); });
  }
  int far_unavoidable() const {
    return far_sum([](const Cell& cell) { return cell.unavoidable; });
  }

 private:
  template <typename Count>
  int far_sum(const Count& count) const {
    int sum = 0;
    for (const Cell& cell : cells[static_cast<size_t>(Distance::far)]) sum += count(cell);
    return sum;
  }
};

std::optional<Table> measure(const EvalObstacleStopOptions& o, Vision vision) {
  graph::LoadOptions load;
  if (vision == Vision::absent) load.mode = "blind";
  auto yard = load_graph(ace_registry(), shipped("graph/yard.yaml"), load);
  if (!yard) return std::nullopt;
  StopTrials trials(std::move(*yard), vision, o.seed);
  Table table;
  for (int i = 0; i < o.trials; ++i) {
    const StopTrial trial = draw_trial(o.seed, static_cast<uint64_t>(i));
    const StopOutcome outcome = trials.run(trial);
    table.cells[static_cast<size_t>(outcome.distance)][static_cast<size_t>(trial.walk)].add(outcome);
    table.chain_misses += outcome.chain_misses;
    table.vision_misses += outcome.vision_misses;
  }
  return table;
}

Json to_json(const Cell& cell) {
  std::vector<double> impacts = cell.impacts_m_s;
  std::sort(impacts.begin(), impacts.end());
  const auto figure = [](double value, bool known) { return known ? Json(value) : Json(nullptr); };
  return {{"trials", cell.trials},
          {"contacts", impacts.size()},
          {"unavoidable", cell.unavoidable},
          {"impact_p50_m_s", impacts.empty() ? Json(nullptr) : Json(impacts[impacts.size() / 2])},
          {"impact_max_m_s", impacts.empty() ? Json(nullptr) : Json(impacts.back())},
          {"least_gap_m", figure(cell.least_gap_m, std::isfinite(cell.least_gap_m))}};
}

Json to_json(const Table& table) {
  Json json;
  for (size_t d = 0; d < kDistances; ++d)
    for (size_t w = 0; w < kWalks; ++w)
      if (table.cells[d][w].trials > 0)
        json[std::string(to_string(static_cast<Distance>(d)))][std::string(to_string(static_cast<Walk>(w)))] =
            to_json(table.cells[d][w]);
  json["far_contacts"] = table.far_contacts();
  json["far_unavoidable"] = table.far_unavoidable();
  json["chain_misses"] = table.chain_misses;
  json["vision_misses"] = table.vision_misses;
  return json;
}

void print(const Json& table, Vision vision, int trials) {
  const auto figure = [](const Json& value) {
    char text[16] = "-";
    if (!value.is_null()) std::snprintf(text, sizeof text, "%.2f", value.get<double>());
    return std::string(text);
  };
  std::printf("%d trials, vision %s\n", trials, std::string(to_string(vision)).c_str());
  std::printf(
      "  contacts: touched while the robot moved faster than 0.05 m/s; unavoidable: so also by one that brakes\n"
      "  as soon as he is first seen in its lane\n");
  std::printf("  %-13s %-9s %7s %9s %12s %11s %11s %10s\n", "first seen", "walk", "trials", "contacts", "unavoidable",
              "impact p50", "impact max", "least gap");
  for (const auto& [distance, walks] : table.items()) {
    if (!walks.is_object()) continue;
    for (const auto& [walk, cell] : walks.items())
      std::printf("  %-13s %-9s %7d %9d %12d %7s m/s %7s m/s %8s m\n", distance.c_str(), walk.c_str(),
                  cell["trials"].get<int>(), cell["contacts"].get<int>(), cell["unavoidable"].get<int>(),
                  figure(cell["impact_p50_m_s"]).c_str(), figure(cell["impact_max_m_s"]).c_str(),
                  figure(cell["least_gap_m"]).c_str());
  }
  std::printf(
      "  far: %d contacts, %d of them unavoidable; deadlines missed by laser, base and obstacle_stop: %d; by the "
      "loads: %d\n",
      table["far_contacts"].get<int>(), table["far_unavoidable"].get<int>(), table["chain_misses"].get<int>(),
      table["vision_misses"].get<int>());
}

}  // namespace

int evaluate(const EvalObstacleStopOptions& o) {
  try {
    Json all{{"trials", o.trials}, {"seed", o.seed}};
    bool kept = true;
    for (const Vision vision : {Vision::absent, Vision::overloaded, Vision::hanging}) {
      if (o.vision != "all" && o.vision != to_string(vision)) continue;
      const auto table = measure(o, vision);
      if (!table) return kBadInput;
      const Json json = to_json(*table);
      kept = kept && table->far_contacts() == table->far_unavoidable() && table->chain_misses == 0;
      if (!o.json) print(json, vision, o.trials);
      all["vision"][std::string(to_string(vision))] = json;
    }
    if (o.json) std::printf("%s\n", all.dump(2).c_str());
    return kept ? kOk : kNotOk;
  } catch (const std::exception& error) {
    return refuse(error.what(), kDeviceOrSystem);
  }
}

}  // namespace takt::command
