// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <opencv2/core.hpp>
#include <sstream>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/object_3d/evaluate.hpp"
#include "rt/file/output_file.hpp"

namespace takt::command {
namespace {

using namespace object_3d;
using Json = nlohmann::ordered_json;

constexpr double kMeasured[] = {0, 0.06, 0.12};  ///< colour_max, on recordings

struct Results {
  MeasurementOfSolids solids;
  std::vector<Classified> classified;
  LabelledScenes labelled;
  std::vector<std::pair<double, std::vector<MatchedScene>>> matched;
};

Results measure_all(const EvalObjects3dOptions& o) {
  SceneParameters scenes;
  scenes.disparity_sigma_px = o.sigma_px;
  Results r;
  r.solids = measure_solids(scenes, o.seed, o.samples);
  // Seeds apart from one another: what is learnt is never asked.
  const Training training = make_training(table_models(), scenes, o.seed * 10 + 1, o.samples);
  const Training known = make_training(table_models(), scenes, o.seed * 10 + 2, o.samples);
  const Training strange = make_training(strange_models(), scenes, o.seed * 10 + 3, o.samples);
  r.classified = compare_classifiers(training, known, strange);
  r.labelled = label_scenes(training, scenes, o.seed * 10 + 4, o.samples);
  if (!o.write.empty()) {
    std::ostringstream file;
    write_training(file, training);
    require_written(write_file(o.write, file.str()));
  }
  if (!o.data.empty())
    for (const double colour_max : kMeasured) r.matched.emplace_back(colour_max, match_recordings(o.data, colour_max));
  return r;
}

Json to_json(const EvalObjects3dOptions& o, const Results& r) {
  Json out{{"seed", o.seed}, {"samples", o.samples}, {"disparity_sigma_px", o.sigma_px}};
  out["solids"] = {{"shown", r.solids.solids}, {"found", r.solids.found}, {"attributes", Json::array()}};
  for (const AttributeError& e : r.solids.errors)
    out["solids"]["attributes"].push_back({{"solid", e.solid},
                                           {"attribute", name_of(e.attribute)},
                                           {"bias_pct", e.bias_pct},
                                           {"median_pct", e.median_pct},
                                           {"p95_pct", e.p95_pct},
                                           {"largest_pct", e.largest_pct},
                                           {"within_5_pct", e.within_5_pct},
                                           {"by_principal_axes_median_pct", e.by_axes_median_pct}});
  out["classifiers"] = Json::array();
  for (const Classified& c : r.classified)
    out["classifiers"].push_back({{"method", to_string(c.method)},
                                  {"right_pct", c.right_pct},
                                  {"wrong_pct", c.wrong_pct},
                                  {"refused_pct", c.refused_pct},
                                  {"left_out_refused_pct", c.left_out_refused_pct},
                                  {"strange_refused_pct", c.strange_refused_pct},
                                  {"time_us", c.time_us}});
  const LabelledScenes& l = r.labelled;
  out["three_objects"] = {{"scenes", l.scenes},
                          {"all_right", l.all_right},
                          {"objects", l.objects},
                          {"found", l.found},
                          {"right", l.right},
                          {"strange", l.strange},
                          {"strange_refused", l.strange_refused},
                          {"time_ms_p50", l.time_ms_p50},
                          {"time_ms_max", l.time_ms_max}};
  out["recordings"] = Json::array();
  for (const auto& [colour_max, scenes] : r.matched)
    for (const MatchedScene& s : scenes)
      out["recordings"].push_back({{"colour_max", colour_max},
                                   {"name", s.name},
                                   {"labelled", s.labelled},
                                   {"found", s.found},
                                   {"matched", s.matched},
                                   {"mean_overlap", s.mean_overlap},
                                   {"time_ms", s.time_ms}});
  return out;
}

void print(const Results& r) {
  std::printf("%zu solids alone on a table, %zu found\n", r.solids.solids, r.solids.found);
  std::printf("%-9s %-8s %7s %9s %7s %7s %11s %22s\n", "solid", "measure", "bias %", "median %", "p95 %", "max %",
              "within 5 %", "principal axes median");
  for (const AttributeError& e : r.solids.errors) {
    std::printf("%-9s %-8s %7.2f %9.2f %7.2f %7.2f %11.1f", e.solid.c_str(), name_of(e.attribute).data(), e.bias_pct,
                e.median_pct, e.p95_pct, e.largest_pct, e.within_5_pct);
    if (e.by_axes_median_pct >= 0) std::printf(" %22.2f", e.by_axes_median_pct);
    std::printf("\n");
  }
  std::printf("\n%-36s %7s %7s %10s | %s\n", "classifier", "right %", "wrong %", "unknown %",
              "unknown: class left out %, strange %, us a decision");
  for (const Classified& c : r.classified)
    std::printf("%-36s %7.1f %7.1f %10.1f | %24.1f %10.1f %16.2f\n", to_string(c.method).data(), c.right_pct,
                c.wrong_pct, c.refused_pct, c.left_out_refused_pct, c.strange_refused_pct, c.time_us);
  const LabelledScenes& l = r.labelled;
  std::printf(
      "\nthree things a scene: %zu of %zu scenes all right; %zu of %zu known found, %zu right; %zu of %zu strange "
      "unknown; %.1f ms of CPU a cloud (max %.1f)\n",
      l.all_right, l.scenes, l.found, l.objects, l.right, l.strange_refused, l.strange, l.time_ms_p50, l.time_ms_max);
  for (const auto& [colour_max, scenes] : r.matched) {
    size_t labelled = 0, matched = 0;
    std::printf("\nrecordings, colour_max %.2f: labelled, found, matched, mean overlap, ms\n", colour_max);
    for (const MatchedScene& s : scenes) {
      std::printf("  %-12s %9zu %6zu %8zu %13.2f %5.1f\n", s.name.c_str(), s.labelled, s.found, s.matched,
                  s.mean_overlap, s.time_ms);
      labelled += s.labelled, matched += s.matched;
    }
    std::printf("  %zu of %zu objects matched\n", matched, labelled);
  }
}

}  // namespace

int evaluate(const EvalObjects3dOptions& options) {
  cv::setNumThreads(1);
  const Results results = measure_all(options);
  if (options.json) std::printf("%s\n", to_json(options, results).dump(2).c_str());
  else print(results);
  return kOk;
}

}  // namespace takt::command
