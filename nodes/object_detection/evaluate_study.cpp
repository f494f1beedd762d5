// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/evaluate_study.hpp"

#include <algorithm>

#include "nodes/object_detection/stage_errors.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::object_detection {
namespace {

DatabaseObject with_references(DatabaseObject object, size_t references) {
  const std::vector<ReferenceView> views = object.views;
  if (references > 0) object.views.clear();
  for (size_t i = 0; i < references; ++i) object.views.push_back(views[i % views.size()]);
  return object;
}

/// Area that a window and the object have in common, px.
int common_px(const SearchGrid& grid, size_t window, const PlacedObject& object) {
  const int x = grid.x0(static_cast<int>(window) % grid.columns), y = grid.y0(static_cast<int>(window) / grid.columns);
  const auto common = [&](int from, int of_object) {
    return std::max(0, std::min(from + grid.window_px, of_object + object.side) - std::max(from, of_object));
  };
  return common(x, object.x) * common(y, object.y);
}

}  // namespace

StageFigures study_stage(Stage stage, std::span<const DatabaseObject> database, std::span<const Scene> scenes,
                         const DetectorParameters& p, size_t references) {
  std::vector<DatabaseObject> objects;
  for (const DatabaseObject& object : database) objects.push_back(with_references(object, references));
  const CascadeReferences cascade = cascade_references(objects, p);
  const StageReferences& all = cascade[static_cast<size_t>(stage)];
  StageFigures figures;
  std::vector<double> times_ms;
  size_t windows = 0, excluded = 0, missed = 0, placed = 0;
  for (const Scene& scene : scenes) {
    for (const PlacedObject& object : scene.objects) {
      const SearchGrid grid = make_search_grid(scene.width, scene.height, objects[0].views[0].side_px, p.window_px);
      StageErrors errors(stage, grid, all.histograms[object.object], p);
      const int64_t start = thread_cpu_ns();
      const std::vector<float> error = errors.run(scene.view());
      times_ms.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
      const double threshold = all.limits[object.object][0].threshold;
      double least = 1;
      std::vector<float> elsewhere;
      for (size_t window = 0; window < error.size(); ++window) {
        const int common = common_px(grid, window, object);
        if (common == 0) elsewhere.push_back(error[window]);
        if (2 * common >= object.side * object.side) least = std::min<double>(least, error[window]);
        excluded += error[window] >= threshold;
      }
      windows += error.size();
      missed += least >= threshold;
      figures.contrast += 1 - least / std::max(1e-6, median(elsewhere));
      ++placed;
    }
  }
  const auto share = [](double part, size_t whole) { return whole == 0 ? 0 : part / static_cast<double>(whole); };
  figures.time_ms = median(times_ms);
  figures.excluded_pct = 100 * share(static_cast<double>(excluded), windows);
  figures.missed_pct = 100 * share(static_cast<double>(missed), placed);
  figures.contrast = share(figures.contrast, placed);
  return figures;
}

}  // namespace takt::object_detection
