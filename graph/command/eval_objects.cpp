// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "graph/command/eval_command.hpp"
#include "graph/command/prepare.hpp"
#include "nodes/object_detection/evaluate.hpp"

namespace takt::command {
namespace {

using namespace object_detection;
using Json = nlohmann::ordered_json;

/// Factors on all thresholds at which the trade-off between excluded windows and missed objects is shown.
constexpr double kFactors[] = {0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4};

struct Results {
  Measurement ours, mean_colour;
  double time_ms = 0;
  int windows_per_frame = 0;
};

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

Results measure_all(const EvalObjectsOptions& options) {
  const auto database =
      read_database(options.database.empty() ? shipped("graph/objects") : options.database, 48, TestViews::read);
  const SceneParameters scenes;
  DetectorParameters p;
  p.bins = options.bins == "64x32x2" ? ColourBins::hsv_64x32x2 : ColourBins::hsv_64x64x1;
  Detector detector(scenes.width, scenes.height, database, p);
  ColourStageTest ours(detector);
  MeanColourTest mean_colour(detector.grid(), database);
  Results results;
  for (int i = 0; i < options.frames; ++i) {
    const Scene scene = make_scene(database, scenes, options.seed, static_cast<uint64_t>(i));
    measure(scene, detector.grid(), database.size(), ours, results.ours);
    measure(scene, detector.grid(), database.size(), mean_colour, results.mean_colour);
  }
  results.time_ms = median(ours.times_ms());
  results.windows_per_frame = detector.grid().windows();
  return results;
}

Json curve(const Measurement& measurement) {
  Json rows = Json::array();
  for (const double factor : kFactors) {
    const Exclusion e = measurement.at(factor);
    rows.push_back({{"threshold_scale", factor}, {"excluded_pct", e.excluded_pct}, {"missed_pct", e.missed_pct}});
  }
  return rows;
}

Json to_json(const EvalObjectsOptions& options, const Results& r) {
  const Exclusion now = r.ours.at(1);
  const double no_miss = r.ours.no_miss_factor();
  const Exclusion baseline = r.mean_colour.at(r.mean_colour.no_miss_factor());
  const auto windows = r.ours.window_factor.size();
  return {{"excluded_pct", now.excluded_pct},
          {"missed_pct", now.missed_pct},
          {"excluded_at_no_miss_pct", r.ours.at(no_miss).excluded_pct},
          {"threshold_scale_at_no_miss", no_miss},
          {"windows", windows},
          {"windows_per_frame", r.windows_per_frame},
          {"without_object_pct",
           100.0 - 100.0 * static_cast<double>(r.ours.covering_windows) / static_cast<double>(windows)},
          {"objects", r.ours.object_factor.size()},
          {"frames", options.frames},
          {"seed", options.seed},
          {"time_ms", r.time_ms},
          {"curve", curve(r.ours)},
          {"baseline",
           {{"name", "mean colour, threshold fitted to miss none"},
            {"excluded_pct", baseline.excluded_pct},
            {"missed_pct", baseline.missed_pct}}}};
}

void print(const Json& out) {
  const auto number = [](const Json& value) { return value.get<double>(); };
  std::printf("%-44s %10s %9s %8s\n", "method", "excluded %", "missed %", "CPU ms");
  std::printf("%-44s %10.2f %9.2f %8.2f\n", "takt colour stage, thresholds of the database",
              number(out["excluded_pct"]), number(out["missed_pct"]), number(out["time_ms"]));
  std::printf("%-44s %10.2f %9.2f %8s\n", "takt colour stage, scaled to miss none",
              number(out["excluded_at_no_miss_pct"]), 0.0, "-");
  std::printf("%-44s %10.2f %9.2f %8s\n", out["baseline"]["name"].get<std::string>().c_str(),
              number(out["baseline"]["excluded_pct"]), number(out["baseline"]["missed_pct"]), "-");
  std::printf("%.0f frames of %.0f windows, %.0f objects; %.2f %% of the windows show less than half an object\n",
              number(out["frames"]), number(out["windows_per_frame"]), number(out["objects"]),
              number(out["without_object_pct"]));
  std::printf("none missed from threshold_scale %.3f on; trade-off:\n", number(out["threshold_scale_at_no_miss"]));
  for (const Json& row : out["curve"])
    std::printf("  threshold_scale %.2f %26s %10.2f %9.2f\n", number(row["threshold_scale"]), "",
                number(row["excluded_pct"]), number(row["missed_pct"]));
}

int evaluate(const EvalObjectsOptions& options) {
  try {
    cv::setNumThreads(1);
    const Json out = to_json(options, measure_all(options));
    if (options.json) std::printf("%s\n", out.dump(2).c_str());
    else print(out);
    return kOk;
  } catch (const std::exception& error) {
    return refuse(error.what(), kBadInput);
  }
}

}  // namespace

void add_eval_objects(CLI::App& eval, EvalObjectsOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("objects", "windows excluded and objects missed on generated scenes");
  app->add_option("--database", o.database, "folder with objects.txt (default graph/objects)");
  app->add_option("--bins", o.bins, "64x64x1 (default) | 64x32x2")->check(CLI::IsMember({"64x32x2", "64x64x1"}));
  app->add_option("--seed", o.seed, "seed of the scenes (default 1)");
  app->add_option("--frames", o.frames, "number of scenes (default 100)")->check(CLI::Range(1, 100000));
  app->add_flag("--json", o.json, "one JSON object on stdout");
  app->callback([&] { exit_code = evaluate(o); });
}

}  // namespace takt::command
