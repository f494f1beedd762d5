// SPDX-License-Identifier: Apache-2.0
// The histogram cascade: its first two stages on every window, co-occurrences on every window, the whole of it with 1,
// 4 and 16 objects. The references count and compare everything.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "graph/cli/outcome.hpp"
#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/reference.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "rt/msg/ace/detections.hpp"

namespace takt::bench {

std::vector<Row> run_objects(const Options& options);
std::vector<Row> run_detection(const Options& options);

namespace {

using namespace object_detection;

template <class Theirs, class Ours>
void compare_rows(std::vector<Row>& rows, const std::string& name, const std::string& reference, int rounds,
                  const Theirs& theirs, const Ours& ours) {
  std::fprintf(stderr, "%s against %s\n", name.c_str(), reference.c_str());
  ours();
  const Compared compared = compare(
      static_cast<size_t>(rounds), [&] { return cpu_ms(theirs); }, [&] { return cpu_ms(ours); });
  add_pair(rows, {name, "ms", 0, compared.changed, {}, {}, {}, "one thread"}, reference, compared.pairs);
}

std::vector<std::vector<Histogram>> histograms(std::span<const DatabaseObject> database,
                                               const std::function<Histogram(ImageView<const uint8_t>)>& histogram) {
  std::vector<std::vector<Histogram>> objects;
  for (const DatabaseObject& object : database) {
    auto& views = objects.emplace_back();
    for (const ReferenceView& view : object.views) views.push_back(histogram(view.view()));
  }
  return objects;
}

/// 656 x 496: 38 x 28 = 1,064 windows at a stride of exactly 16. All pass, for all objects.
void first_two_stages(std::vector<Row>& rows, std::span<const DatabaseObject> database, int rounds) {
  SceneParameters size;
  size.width = 656, size.height = 496;
  const Scene scene = make_scene(database, size, 1, 0);
  DetectorParameters p;
  p.last = Stage::orientation;
  p.threshold_scale = 4;
  Detector detector(size.width, size.height, database, p);
  const SearchGrid& grid = detector.grid();
  const auto colours = histograms(database, [&](auto view) { return colour_histogram(view, p.bins); });
  const OrientationBins bins(p.orientations);
  const auto orientations = histograms(database, [&](auto view) { return orientation_histogram(view, bins); });
  compare_rows(
      rows, "objects/ch+hog/" + std::to_string(grid.windows()) + "-windows", "window by window, bin by bin", rounds,
      [&] {
        colour_stage_reference(grid, p.bins, colours, scene.view());
        for (int window = 0; window < grid.windows(); ++window) {
          const auto histogram =
              orientation_window_reference(scene.view(), grid.x0(window % grid.columns), grid.y0(window / grid.columns),
                                           grid.window_px, p.orientations);
          for (const auto& views : orientations)
            for (const Histogram& view : views) missing_mass(histogram, view.count);
        }
      },
      [&] { detector.run(scene.view()); });
}

/// Every tenth window of 640 x 480, for all objects.
void cooccurrences(std::vector<Row>& rows, std::span<const DatabaseObject> database, int rounds) {
  const SceneParameters size;
  const Scene scene = make_scene(database, size, 1, 0);
  const SearchGrid grid = make_search_grid(size.width, size.height, 48, 64);
  const PairBins bins;
  const auto objects = histograms(database, [&](auto view) { return cooccurrence_histogram(view, bins); });
  CooccurrenceStage stage(grid, bins, objects);
  constexpr int kStep = 10;
  compare_rows(
      rows, "objects/cch/100-windows", "every offset of every pixel", rounds,
      [&] {
        for (int window = 0; window < grid.windows(); window += kStep) {
          const auto histogram = cooccurrence_window_reference(scene.view(), grid.x0(window % grid.columns),
                                                               grid.y0(window / grid.columns), grid.window_px, bins);
          for (const auto& views : objects)
            for (const Histogram& view : views) missing_mass(histogram, view.count);
        }
      },
      [&] {
        for (size_t window = 0; window < static_cast<size_t>(grid.windows()); window += kStep)
          for (size_t object = 0; object < objects.size(); ++object) stage.missing(scene.view(), window, object);
      });
}

/// The database's objects `times` over, each time with other channels in the place of blue, green and red.
std::vector<DatabaseObject> multiplied(std::span<const DatabaseObject> database, size_t times) {
  constexpr size_t kChannels[][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}, {0, 2, 1}};
  std::vector<DatabaseObject> all;
  for (size_t k = 0; k < times; ++k) {
    for (DatabaseObject object : database) {
      for (auto* views : {&object.views, &object.test_views})
        for (ReferenceView& view : *views)
          for (size_t i = 0; i < view.pixels.size(); i += 3) {
            const uint8_t bgr[] = {view.pixels[i], view.pixels[i + 1], view.pixels[i + 2]};
            for (size_t c = 0; c < 3; ++c) view.pixels[i + c] = bgr[kChannels[k][c]];
          }
      object.name += "_" + std::to_string(k);
      all.push_back(std::move(object));
    }
  }
  return all;
}

constexpr double kBudget_ms = 12, kReserve_ms = 1;  // of object_detection in schedules/thesis.yaml; the node's default

/// Scenes with up to three objects, each searched to the end, or as far as the graph's budget goes: then the worst
/// counts, against the budget.
Row whole_cascade(std::span<const DatabaseObject> database, int scenes, bool within_budget) {
  const SceneParameters size;
  Detector detector(size.width, size.height, database, {});
  const std::string what = within_budget ? "budget_" + std::to_string(static_cast<int>(kBudget_ms)) + "ms" : "cascade";
  Row row{
      "objects/" + what + "/" + std::to_string(database.size()) + "-objects", "ms", 0, {}, {}, {}, {}, "one thread"};
  std::fprintf(stderr, "%s\n", row.name.c_str());
  std::vector<Detection> boxes(Detector::kMostDetections);
  for (int i = 0; i < scenes; ++i) {
    const Scene scene = make_scene(database, size, 1, static_cast<uint64_t>(i));
    row.samples.add(cpu_ms([&] {
      const int64_t end_ns = thread_cpu_ns() + static_cast<int64_t>(kBudget_ms * 1e6);
      const auto left_ns = [&] {
        return within_budget ? end_ns - thread_cpu_ns() : std::numeric_limits<int64_t>::max();
      };
      detector.run_within(scene.view(), nullptr, left_ns, static_cast<int64_t>(kReserve_ms * 1e6));
      detector.detections(0.3, boxes);
    }));
  }
  row.value = (within_budget ? row.samples.max() : row.samples.quantile(0.5)).value_or(0);
  if (within_budget) {
    row.reference = "the budget";
    row.reference_value = kBudget_ms;
    row.ratio = row.value / kBudget_ms;
  }
  return row;
}

}  // namespace

std::vector<Row> run_objects(const Options& options) {
  cv::setNumThreads(1);
  const auto database = read_database(command::shipped("graph/objects"), 48, TestViews::read);
  std::vector<Row> rows;
  first_two_stages(rows, database, options.rounds_or(10));
  cooccurrences(rows, database, options.rounds_or(10));
  const auto many = multiplied(database, 4);
  for (const bool within_budget : {false, true})
    for (const size_t objects : {1, 4, 16})
      rows.push_back(whole_cascade(std::span(many).first(objects), 20 * options.rounds_or(10), within_budget));
  return rows;
}

/// The same under the suite's name in the house plan.
std::vector<Row> run_detection(const Options& options) {
  std::vector<Row> rows = run_objects(options);
  for (Row& row : rows) row.name.replace(0, row.name.find('/'), "detection");
  return rows;
}

}  // namespace takt::bench
