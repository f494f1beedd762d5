// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/terrain.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ground_map {

void cells_around(ImageView<const int16_t> map, const Window& window, const PlanarPose& robot_in_map,
                  const TerrainShape& shape, std::span<int16_t> out) {
  const FloorPoint origin = window.origin();
  for (int row = 0; row < shape.rows; ++row)
    for (int column = 0; column < shape.columns; ++column) {
      const FloorPoint p = transformed(
          robot_in_map, {(column + 0.5 - shape.left) * shape.cell_m, (row + 0.5 - shape.behind) * shape.cell_m});
      const double x = std::floor((p.x_m - origin.x_m) / window.cell_m),
                   y = std::floor((p.y_m - origin.y_m) / window.cell_m);
      const bool inside = x >= 0 && y >= 0 && x < window.cells && y < window.cells;
      out[static_cast<size_t>(row * shape.columns + column)] =
          inside ? map.at(static_cast<int>(x), static_cast<int>(y)) : kUnknown;
    }
}

TerrainLearning::TerrainLearning(const TerrainShape& shape) : shape_(shape) {
  for (auto& sums : sums_) sums.resize(shape.cells());
}

void TerrainLearning::add(size_t kind, std::span<const int16_t> cells) {
  ++maps_[kind];
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i] == kUnknown) continue;
    sums_[kind][i].value += cells[i];
    ++sums_[kind][i].count;
  }
}

TerrainMaps TerrainLearning::learnt() const {
  TerrainMaps maps{shape_, {}};
  for (size_t kind = 0; kind < kTerrainKinds; ++kind)
    for (const Sum& sum : sums_[kind])
      maps.cells[kind].push_back(sum.count == 0 ? kUnknown
                                                : static_cast<int16_t>((sum.value + sum.count / 2) / sum.count));
  return maps;
}

// Whole numbers up to the root: at most 1e6 for a product, 1e12 for n cells squared at n = 1000.
std::optional<double> correlation(std::span<const int16_t> around, std::span<const int16_t> kind, Centre centre,
                                  double known_min) {
  int64_t n = 0, sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  const auto from_middle = [](int16_t cell) { return int64_t{cell == kUnknown ? 0 : cell - kOccupied / 2}; };
  for (size_t i = 0; i < around.size(); ++i) {
    if (around[i] == kUnknown || (kind[i] == kUnknown && centre == Centre::mean)) continue;
    n += kind[i] != kUnknown;
    const int64_t a = from_middle(around[i]), b = from_middle(kind[i]);
    sum_a += a, sum_b += b;
    aa += a * a, bb += b * b, ab += a * b;
  }
  if (n == 0 || static_cast<double>(n) < known_min * static_cast<double>(around.size())) return std::nullopt;
  if (centre == Centre::mean) {
    aa = n * aa - sum_a * sum_a;
    bb = n * bb - sum_b * sum_b;
    ab = n * ab - sum_a * sum_b;
  }
  if (aa == 0 || bb == 0) return std::nullopt;
  return static_cast<double>(ab) / std::sqrt(static_cast<double>(aa) * static_cast<double>(bb));
}

TerrainClassifier::TerrainClassifier(TerrainMaps maps, const TerrainParameters& parameters)
    : maps_(std::move(maps)), p_(parameters) {
  counters_[terrain_kind::unknown] = 1000;
  answer_.hypotheses[terrain_kind::unknown] = 1;
}

const Terrain& TerrainClassifier::step(std::span<const int16_t> cells) {
  double best = -2;
  for (size_t kind = 0; kind < kTerrainKinds; ++kind) {
    const auto c = correlation(cells, maps_.cells[kind], p_.centre, p_.known_min);
    answer_.correlations[kind] = static_cast<float>(c.value_or(0));
    if (!c || !(*c > best)) continue;
    best = *c;
    believed_ = kind;
  }
  if (!(best > (believed_ == terrain_kind::crossing ? p_.crossing_min : p_.correlation_min)))
    believed_ = terrain_kind::unknown;
  for (size_t i = 0; i < kHypotheses; ++i) {
    counters_[i] = std::clamp(counters_[i] + (i == believed_ ? p_.up : -p_.down), 0, 1000);
    answer_.hypotheses[i] = static_cast<float>(counters_[i]) / 1000;
  }
  const auto highest = std::max_element(counters_.begin(), counters_.end());
  if (*highest > counters_[answer_.kind]) answer_.kind = static_cast<uint8_t>(highest - counters_.begin());
  return answer_;
}

}  // namespace takt::ground_map
