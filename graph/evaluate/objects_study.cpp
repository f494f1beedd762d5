// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/object_detection/evaluate_study.hpp"
#include "nodes/picture/curves.hpp"

namespace takt::command {
namespace {

using namespace object_detection;
using Json = nlohmann::ordered_json;

struct Method {
  std::string name;
  Stage stage;
  DetectorParameters p;
};

std::vector<Method> methods() {
  std::vector<Method> methods;
  const auto add = [&](const std::string& name, Stage stage) -> DetectorParameters& {
    methods.push_back({name, stage, {}});
    return methods.back().p;
  };
  const std::pair<int, ColourBins> splits[] = {{32, ColourBins::hsv_8x4x1},
                                               {256, ColourBins::hsv_16x16x1},
                                               {1024, ColourBins::hsv_32x32x1},
                                               {4096, ColourBins::hsv_64x64x1}};
  for (const auto& [bins, split] : splits) add(fmt::format("CH {}", bins), Stage::colour).bins = split;
  for (const int count : {8, 32, 180, 360}) add(fmt::format("HOG {}", count), Stage::orientation).orientations = count;
  for (const PairBins& bins : {PairBins{5, 5}, {20, 5}, {5, 25}, {20, 25}})
    add(fmt::format("CCH ({},{})", bins.colours, bins.distances), Stage::cooccurrence).pairs = bins;
  return methods;
}

/// What is varied, and what came out of it, value by value.
struct Table {
  std::string title, parameter;
  std::vector<std::string> names;
  std::vector<StageFigures> rows;
};

void print(const Table& table) {
  fmt::print("\n{}\n{:<14} {:>8} {:>11} {:>9} {:>9}\n", table.title, table.parameter, "CPU ms", "excluded %",
             "missed %", "contrast");
  for (size_t i = 0; i < table.rows.size(); ++i)
    fmt::print("{:<14} {:8.2f} {:11.1f} {:9.1f} {:9.2f}\n", table.names[i], table.rows[i].time_ms,
               table.rows[i].excluded_pct, table.rows[i].missed_pct, table.rows[i].contrast);
}

Json to_json(const Table& table) {
  Json rows = Json::array();
  for (size_t i = 0; i < table.rows.size(); ++i)
    rows.push_back({{table.parameter, table.names[i]},
                    {"time_ms", table.rows[i].time_ms},
                    {"excluded_pct", table.rows[i].excluded_pct},
                    {"missed_pct", table.rows[i].missed_pct},
                    {"contrast", table.rows[i].contrast}});
  return {{"title", table.title}, {"rows", rows}};
}

void draw(const std::string& file, const Table& table) {
  std::vector<double> values;
  picture::Curve time{"CPU ms", {}}, excluded{"excluded %", {}}, contrast{"contrast", {}};
  for (size_t i = 0; i < table.rows.size(); ++i) {
    values.push_back(static_cast<double>(i + 1));
    time.values.push_back(table.rows[i].time_ms);
    excluded.values.push_back(table.rows[i].excluded_pct);
    contrast.values.push_back(table.rows[i].contrast);
  }
  picture::write_curves(file, "row", values, {time, excluded, contrast});
}

}  // namespace

void study_objects(const EvalObjectsOptions& options, std::span<const DatabaseObject> database) {
  SceneParameters p;
  p.fewest_objects = p.most_objects = 1;
  p.scale_max = 1.3;
  std::vector<Scene> scenes;
  for (int i = 0; i < options.frames; ++i)
    scenes.push_back(make_scene(database, p, options.seed, static_cast<uint64_t>(i)));
  std::vector<Table> tables;
  Table& bins = tables.emplace_back(Table{"bins, automatic thresholds, one object at a time", "bins", {}, {}});
  for (const Method& method : methods()) {
    bins.names.push_back(method.name);
    bins.rows.push_back(study_stage(method.stage, database, scenes, method.p));
  }
  const std::pair<const char*, Stage> stages[] = {
      {"CH 4096", Stage::colour}, {"HOG 360", Stage::orientation}, {"CCH (20,25)", Stage::cooccurrence}};
  for (const auto& [name, stage] : stages) {
    Table thresholds{fmt::format("{}: thresholds", name), "factor", {}, {}};
    for (const double factor : {0.5, 0.75, 1.0, 1.25, 1.5}) {
      DetectorParameters scaled;
      scaled.threshold_scale = factor;
      thresholds.names.push_back(fmt::format("{:.2f}", factor));
      thresholds.rows.push_back(study_stage(stage, database, scenes, scaled));
    }
    tables.push_back(thresholds);
  }
  for (const auto& [name, stage] : stages) {
    Table references{
        fmt::format("{}: references (views again from the first beyond those there are)", name), "references", {}, {}};
    for (const size_t count : {1, 2, 4, 8, 18, 50}) {
      references.names.push_back(std::to_string(count));
      references.rows.push_back(study_stage(stage, database, scenes, {}, count));
    }
    tables.push_back(references);
  }
  Json out = Json::array();
  for (const Table& table : tables) {
    if (options.json) out.push_back(to_json(table));
    else print(table);
  }
  if (options.json) std::printf("%s\n", out.dump(2).c_str());
  if (!options.picture.empty()) draw(options.picture, tables[0]);
}

}  // namespace takt::command
