// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/ace/terrain.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/ground_map/terrain_drive.hpp"
#include "nodes/ground_map/terrain_file.hpp"
#include "nodes/picture/draw.hpp"
#include "nodes/picture/image_file.hpp"

namespace takt::command {
namespace {

using namespace ground_map;
using Json = nlohmann::ordered_json;

/// How many images of a kind (rows) were called what (columns).
using Confusion = std::array<std::array<int, kHypotheses>, kHypotheses>;

double right_pct(const Confusion& confusion) {
  int right = 0, all = 0;
  for (size_t truth = 0; truth < kHypotheses; ++truth)
    for (size_t called = 0; called < kHypotheses; ++called) {
      all += confusion[truth][called];
      right += truth == called ? confusion[truth][called] : 0;
    }
  return all == 0 ? 0 : 100.0 * right / all;
}

/// One way to count correlations, with the counters and by the newest map alone.
struct Judged {
  const char* name;
  TerrainParameters parameters;
  Confusion counted{}, alone{};
};

std::vector<Judged> judge(const TerrainMaps& maps, const EvalTerrainOptions& options) {
  std::vector<Judged> ways(2);
  ways[0].name = "undecided";
  ways[1].name = "mean";
  ways[1].parameters.centre = Centre::mean;
  ways[1].parameters.correlation_min = ways[1].parameters.crossing_min = 0.5;
  for (int i = 0; i < options.drives; ++i) {
    TerrainDriveOptions drive;
    drive.seed = options.seed + static_cast<uint64_t>(i);
    std::vector<TerrainClassifier> classifiers;
    for (const Judged& way : ways) classifiers.emplace_back(maps, way.parameters);
    TerrainDrive(drive).run(maps.shape, [&](std::span<const int16_t> around, std::optional<size_t> truth) {
      for (size_t k = 0; k < ways.size(); ++k) {
        const Terrain& answer = classifiers[k].step(around);
        if (!truth) continue;
        ++ways[k].counted[*truth][answer.kind];
        ++ways[k].alone[*truth][classifiers[k].believed()];
      }
    });
  }
  return ways;
}

void print(const char* title, const Confusion& confusion) {
  std::printf("%s: %.1f %% right\n%-10s", title, right_pct(confusion), "truth");
  for (const std::string_view name : kTerrainNames) std::printf(" %9s", std::string(name).c_str());
  std::printf("\n");
  for (size_t truth = 0; truth < kHypotheses; ++truth) {
    std::printf("%-10s", std::string(kTerrainNames[truth]).c_str());
    for (const int count : confusion[truth]) std::printf(" %9d", count);
    std::printf("\n");
  }
}

/// The maps of the four kinds beside each other, heading up.
void write_maps(const std::string& file, const TerrainMaps& maps) {
  constexpr int kScale = 10, kGap = 10;
  const int width = maps.shape.columns * kScale, height = maps.shape.rows * kScale;
  cv::Mat out(height, static_cast<int>(kTerrainKinds) * (width + kGap) - kGap, CV_8UC3, cv::Scalar(255, 200, 120));
  for (size_t kind = 0; kind < kTerrainKinds; ++kind) {
    cv::Mat part(out, cv::Rect(static_cast<int>(kind) * (width + kGap), 0, width, height));
    picture::draw_grid({maps.cells[kind].data(), maps.shape.columns, maps.shape.rows}, kScale,
                       {part.data, width, height, 3, static_cast<ptrdiff_t>(part.step)});
  }
  require_written(picture::write_image(file, out));
}

}  // namespace

int evaluate(const EvalTerrainOptions& options) {
  const TerrainMaps maps = read_terrain(options.maps.empty() ? shipped("graph/terrain.txt") : options.maps).learnt();
  if (!options.picture.empty()) write_maps(options.picture, maps);
  const std::vector<Judged> ways = judge(maps, options);
  Json out;
  for (const Judged& way : ways) {
    out[way.name] = {{"right_pct", right_pct(way.counted)},
                     {"confusion", way.counted},
                     {"newest_alone_right_pct", right_pct(way.alone)},
                     {"newest_alone_confusion", way.alone}};
    if (options.json) continue;
    print(fmt::format("centre {}, with counters", way.name).c_str(), way.counted);
    print(fmt::format("centre {}, the newest map alone", way.name).c_str(), way.alone);
  }
  if (options.json) std::printf("%s\n", out.dump(2).c_str());
  return kOk;
}

}  // namespace takt::command
