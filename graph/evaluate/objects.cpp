// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <limits>
#include <opencv2/core.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/object_detection/evaluate.hpp"
#include "nodes/object_detection/photographs.hpp"
#include "nodes/object_detection/tally.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace object_detection;
using Json = nlohmann::ordered_json;

/// Factors on all thresholds at which the trade-off between excluded windows and missed objects is shown.
constexpr double kFactors[] = {0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4};

/// Smallest scores at which the trade-off between missed objects and false positives is shown; the node's is the first.
constexpr double kScores[] = {0.3, 0.25, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6};

/// What the node leaves of its time (its parameter `reserve`).
constexpr int64_t kReserve_ns = 1'000'000;

/// Names of the stages that the node runs by default, and of those with one more.
constexpr const char *kNodesStages = "ch+hog+cch", *kWithLayout = "ch+hog+cch+layout";

struct Results {
  Measurement ours, mean_colour;
  double time_ms = 0;
  int windows_per_frame = 0;
};

ColourBins bins_of(const EvalObjectsOptions& options) {
  return options.bins == "64x32x2" ? ColourBins::hsv_64x32x2 : ColourBins::hsv_64x64x1;
}

Results measure_all(const EvalObjectsOptions& options, std::span<const DatabaseObject> database) {
  const SceneParameters scenes;
  DetectorParameters p;
  p.last = Stage::colour;
  p.bins = bins_of(options);
  Detector detector(scenes.width, scenes.height, database, p);
  ColourStageTest ours(detector);
  MeanColourTest mean_colour(detector.grid(), database);
  Results results;
  for (int i = 0; i < options.frames; ++i) {
    const Scene scene = make_scene(database, scenes, options.seed, static_cast<uint64_t>(i));
    measure(scene, detector.grid(), database.size(), ours, results.ours);
    measure(scene, detector.grid(), database.size(), mean_colour, results.mean_colour);
  }
  results.time_ms = quantile(ours.times_ms(), 0.5);
  results.windows_per_frame = detector.grid().windows();
  return results;
}

/// The cascade up to one stage, on every image.
struct Contestant {
  std::string name;
  Detector detector;
  std::vector<Tally> tallies;
  std::vector<double> times_ms;
  double budget_ms, searched = 0;  ///< 0: none; share of the windows, sum over the images

  Contestant(std::string stages, Stage last, const EvalObjectsOptions& options, const SceneParameters& scenes,
             std::span<const DatabaseObject> database, std::span<const Photograph> negatives = {})
      : name(std::move(stages)),
        detector(
            scenes.width, scenes.height, database,
            [&] {
              DetectorParameters p;
              p.last = last;
              p.bins = bins_of(options);
              p.scales = parse_scales(options.scales);
              return p;
            }(),
            negatives),
        budget_ms(options.budget_ms) {
    for (const double score : kScores) tallies.emplace_back(score);
  }
  void search(const Scene& scene) {
    std::vector<Detection> boxes(Detector::kMostDetections);
    const int64_t start = thread_cpu_ns();
    const auto left_ns = [&] {
      return budget_ms > 0 ? start + static_cast<int64_t>(budget_ms * 1e6) - thread_cpu_ns()
                           : std::numeric_limits<int64_t>::max();
    };
    detector.run_within(scene.view(), nullptr, left_ns, kReserve_ns);
    boxes.resize(detector.detections(0, boxes));
    times_ms.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
    searched += static_cast<double>(detector.searched());
    for (Tally& tally : tallies) tally.add(scene, boxes);
  }
};

/// Photographs to learn the surroundings from, and to put objects in.
struct Surroundings {
  std::vector<Photograph> negatives;
  std::vector<Photograph> backgrounds;  ///< empty: generated
};

/// Those of `scenes`, by name, that are PNGs of 640 x 480 in colour. Without --negatives every other one is learnt
/// from.
Surroundings surroundings(const EvalObjectsOptions& options, const SceneParameters& p) {
  Surroundings all;
  for (const auto& file : options.negatives) all.negatives.push_back(read_photograph(file));
  if (options.scenes.empty()) return all;
  std::vector<cv::String> files;
  cv::glob((options.scenes / "*.png").string(), files);
  size_t number = 0;
  for (const cv::String& file : files) {
    const auto same = [&](const auto& negative) { return std::filesystem::equivalent(negative, std::string(file)); };
    if (std::any_of(options.negatives.begin(), options.negatives.end(), same)) continue;
    const cv::Mat image = read_values(std::string(file));
    if (image.type() != CV_8UC3 || image.cols != p.width || image.rows != p.height) continue;
    const bool learnt = options.negatives.empty() && number++ % 2 == 1;
    (learnt ? all.negatives : all.backgrounds).push_back(read_photograph(std::string(file)));
  }
  if (all.backgrounds.empty())
    throw std::runtime_error(options.scenes.string() + " holds no colour PNG of 640 x 480 to put objects in");
  return all;
}

/// Trivial, to compare with: of each image the one window whose mean colour is nearest to that of any view.
class NearestMeanColour {
 public:
  NearestMeanColour(const SearchGrid& grid, std::span<const DatabaseObject> database)
      : grid_(grid), objects_(database.size()), test_(grid, database) {}
  void search(const Scene& scene) {
    test_.search(scene);
    Detection best{};
    float least = std::numeric_limits<float>::max();
    for (int window = 0; window < grid_.windows(); ++window)
      for (size_t object = 0; object < objects_; ++object) {
        const float distance = test_.factor(window, object);
        if (distance >= least) continue;
        least = distance;
        const auto edge = static_cast<float>(grid_.window_px);
        best = {static_cast<float>(object),
                static_cast<float>(grid_.x0(window % grid_.columns)),
                static_cast<float>(grid_.y0(window / grid_.columns)),
                edge,
                edge,
                1};
      }
    tally_.add(scene, {&best, 1});
  }
  const Tally& tally() const { return tally_; }

 private:
  SearchGrid grid_;
  size_t objects_;
  MeanColourTest test_;
  Tally tally_;
};

Json to_json(Contestant& contestant) {
  Json scores = Json::array();
  for (const Tally& tally : contestant.tallies)
    scores.push_back({{"min_score", tally.min_score()},
                      {"detected_pct", tally.detected_pct()},
                      {"missed", tally.missed()},
                      {"false_positives", tally.false_positives()}});
  Json occluded = Json::array();
  for (size_t tenth = 0; tenth < Tally::kTenths; ++tenth) occluded.push_back(contestant.tallies[0].missed_pct(tenth));
  return {{"stages", contestant.name},
          {"scores", scores},
          {"missed_pct_by_tenth_occluded", occluded},
          {"searched_pct", 100 * contestant.searched / static_cast<double>(contestant.times_ms.size())},
          {"cpu_ms",
           {{"p50", quantile(contestant.times_ms, 0.5)},
            {"p99", quantile(contestant.times_ms, 0.99)},
            {"max", quantile(contestant.times_ms, 1)}}}};
}

/// The figures that count, of the node's own stages; where there are photographs to learn from, with the layout's.
void add_flat(Json& out, const Json& cascade, const Tally& baseline, bool learnt) {
  for (const Json& set : cascade["stage_sets"]) {
    if (set["stages"] != (learnt ? kWithLayout : kNodesStages)) continue;
    out["stages"] = set["stages"];
    for (const char* key : {"detected_pct", "missed", "false_positives", "min_score"}) out[key] = set["scores"][0][key];
    out["searched_pct"] = set["searched_pct"];
    out["cpu_max_ms"] = set["cpu_ms"]["max"];
  }
  out["baseline"]["detected_pct"] = baseline.detected_pct();
  out["baseline"]["missed"] = baseline.missed();
  out["baseline"]["false_positives"] = baseline.false_positives();
}

/// One object in each of `images` scenes, none in `empty` ones.
void measure_cascade(const EvalObjectsOptions& options, std::span<const DatabaseObject> database, Json& all) {
  SceneParameters p;
  p.scale_min = options.size[0], p.scale_max = options.size[1];
  p.occlusion_max = options.occlusion;
  const auto [negatives, backgrounds] = surroundings(options, p);
  std::vector<Contestant> contestants;
  contestants.reserve(kStages);
  contestants.emplace_back("ch", Stage::colour, options, p, database);
  contestants.emplace_back("ch+hog", Stage::orientation, options, p, database);
  contestants.emplace_back(kNodesStages, Stage::cooccurrence, options, p, database);
  contestants.emplace_back(kWithLayout, Stage::layout, options, p, database, negatives);
  NearestMeanColour baseline(contestants[0].detector.grid(), database);
  for (int i = 0; i < options.images + options.empty; ++i) {
    p.fewest_objects = p.most_objects = i < options.images ? 1 : 0;
    if (!backgrounds.empty()) p.background = backgrounds[static_cast<size_t>(i) % backgrounds.size()].view();
    const Scene scene = make_scene(database, p, options.seed, static_cast<uint64_t>(i));
    for (Contestant& contestant : contestants) contestant.search(scene);
    baseline.search(scene);
  }
  Json out = {{"images", options.images},
              {"images_without_object", options.empty},
              {"objects", database.size()},
              {"occlusion_max", options.occlusion},
              {"budget_ms", options.budget_ms},
              {"photographs", backgrounds.size()},
              {"photographs_learnt_from", negatives.size()},
              {"criterion", "a box of the class covers half of the object, whatever its own size (no overlap of both)"},
              {"stage_sets", Json::array()}};
  for (Contestant& contestant : contestants) out["stage_sets"].push_back(to_json(contestant));
  add_flat(all, out, baseline.tally(), !negatives.empty());
  all["cascade"] = std::move(out);
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

void print_exclusion(const Json& out) {
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

void print_cascade(const Json& all) {
  const Json& out = all["cascade"];
  const auto number = [](const Json& value) { return value.get<double>(); };
  std::printf("\n%.0f images with and %.0f without an object, of %.0f; occluded up to %.0f %%; min_score %.2f\n",
              number(out["images"]), number(out["images_without_object"]), number(out["objects"]),
              100 * number(out["occlusion_max"]), kScores[0]);
  std::printf("detected: %s; photographs: %.0f, learnt from: %.0f\n", out["criterion"].get<std::string>().c_str(),
              number(out["photographs"]), number(out["photographs_learnt_from"]));
  std::printf("%-18s %10s %7s %6s   %-42s %-22s %s\n", "stages", "detected %", "missed", "false",
              "missed % by tenths occluded", "CPU ms p50 p99 max", "searched %");
  for (const Json& set : out["stage_sets"]) {
    const Json& now = set["scores"][0];
    std::printf("%-18s %10.1f %7.0f %6.0f  ", set["stages"].get<std::string>().c_str(), number(now["detected_pct"]),
                number(now["missed"]), number(now["false_positives"]));
    for (const Json& tenth : set["missed_pct_by_tenth_occluded"])
      std::printf(number(tenth) < 0 ? "      -" : " %6.1f", number(tenth));
    std::printf("  %6.2f %6.2f %6.2f %12.1f\n", number(set["cpu_ms"]["p50"]), number(set["cpu_ms"]["p99"]),
                number(set["cpu_ms"]["max"]), number(set["searched_pct"]));
  }
  const Json& baseline = all["baseline"];
  std::printf("%-18s %10.1f %7.0f %6.0f\n", "nearest mean colour", number(baseline["detected_pct"]),
              number(baseline["missed"]), number(baseline["false_positives"]));
  std::printf("%-18s %10d %7d %6d\n", "thesis", 95, 23, 7);
  for (const Json& set : out["stage_sets"]) {
    std::printf("%-18s min_score: missed / false ", set["stages"].get<std::string>().c_str());
    for (const Json& at : set["scores"])
      std::printf("  %.2f: %.0f / %.0f", number(at["min_score"]), number(at["missed"]), number(at["false_positives"]));
    std::printf("\n");
  }
}

}  // namespace

int evaluate(const EvalObjectsOptions& options) {
  cv::setNumThreads(1);
  auto database =
      options.views.empty()
          ? read_database(options.database.empty() ? shipped("graph/objects") : options.database, 48, TestViews::read)
          : read_turntable(options.views, 48);
  for (DatabaseObject& object : database) {
    if (!options.automatic) break;
    object.thresholds = {};
    for (ReferenceView& view : object.views) view.thresholds = {};
  }
  if (options.study) {
    study_objects(options, database);
    return kOk;
  }
  Json out = to_json(options, measure_all(options, database));
  measure_cascade(options, database, out);
  if (options.json) {
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    print_exclusion(out);
    print_cascade(out);
  }
  return kOk;
}

}  // namespace takt::command
