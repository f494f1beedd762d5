// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "nodes/traversability/height_map.hpp"
#include "tests/property_scale.hpp"

using namespace takt::traversability;
using takt::mapping_3d::Position;

namespace {

using CellIndex = std::pair<int64_t, int64_t>;
using Points = std::map<CellIndex, std::vector<Position>>;

/// The rules written out once more, over the points themselves.
struct Reference {
  const HeightParameters& p;
  const Points& points;

  const std::vector<Position>* known(const CellIndex& cell) const {
    const auto at = points.find(cell);
    return at != points.end() && at->second.size() >= static_cast<size_t>(p.points_min) ? &at->second : nullptr;
  }
  static double mean(const std::vector<Position>& cell) {
    double sum = 0;
    for (const Position& q : cell) sum += q.z_m;
    return sum / static_cast<double>(cell.size());
  }
  /// Of the plane that fits best; 0 if the points do not spread by a tenth of a cell in both directions.
  double slope(const std::vector<Position>& cell) const {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Position& q : cell) middle += Eigen::Vector2d(q.x_m, q.y_m) / static_cast<double>(cell.size());
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const Position& q : cell) {
      const Eigen::Vector2d d = Eigen::Vector2d(q.x_m, q.y_m) - middle;
      scatter += d * d.transpose() / static_cast<double>(cell.size());
    }
    if (std::sqrt(scatter.determinant()) <= std::pow(0.1 * p.cell_m, 2)) return 0;
    Eigen::MatrixXd a(cell.size(), 3);
    Eigen::VectorXd z(cell.size());
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const Position& q = cell[static_cast<size_t>(i)];
      a.row(i) << q.x_m - cell[0].x_m, q.y_m - cell[0].y_m, 1;
      z(i) = q.z_m;
    }
    const Eigen::Vector3d plane = a.colPivHouseholderQr().solve(z);
    return std::hypot(plane.x(), plane.y());
  }
  int judge(const CellIndex& cell) const {
    const auto* in = known(cell);
    if (in == nullptr) return kUnknown;
    const auto [low, high] =
        std::minmax_element(in->begin(), in->end(), [](const Position& a, const Position& b) { return a.z_m < b.z_m; });
    bool blocked = high->z_m - low->z_m > p.step_m || slope(*in) > p.slope;
    for (const CellIndex& to : {CellIndex{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const auto* next = known({cell.first + to.first, cell.second + to.second});
      const auto* after = known({cell.first + 2 * to.first, cell.second + 2 * to.second});
      const double cells = next != nullptr ? 1 : 2;
      const auto* beside = next != nullptr ? next : after;
      blocked |=
          beside != nullptr && std::abs(mean(*beside) - mean(*in)) > std::max(p.step_m, p.slope * cells * p.cell_m);
    }
    return blocked ? kBlocked : kFree;
  }
};

}  // namespace

TEST_CASE("every cell is judged as from all of its points, while the window moves") {
  std::mt19937_64 random(takt::test::seed(1));
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  size_t count[3] = {};
  for (int round = 0; round < takt::test::rounds(10); ++round) {
    HeightParameters p;
    p.cell_m = uniform(0.1, 0.3);
    p.window_m = 4;
    p.points_min = 6;
    HeightMap map(p);
    Points all;
    double x = uniform(-9, 9), y = uniform(-9, 9);
    for (int step = 0; step < 8; ++step) {
      x += uniform(-0.7, 0.7), y += uniform(-0.7, 0.7);
      const double a = uniform(-0.3, 0.3), b = uniform(-0.2, 0.2), kerb = uniform(-2, 2);
      std::vector<Position> points;
      for (int i = 0; i < 4000; ++i) {
        const double px = x + uniform(-2.5, 2.5), py = y + uniform(-2.5, 2.5);
        points.push_back({px, py, (step == 0 ? a * px + b * py : 0) + (px > x + kerb ? 0.04 : 0) + uniform(0, 0.005)});
      }
      map.centre(x, y);
      map.add(points, step);
      const auto column0 = std::llround(map.origin_x_m() / p.cell_m), row0 = std::llround(map.origin_y_m() / p.cell_m);
      const auto inside = [&](const CellIndex& c) {
        return c.first >= column0 && c.first < column0 + map.side() && c.second >= row0 && c.second < row0 + map.side();
      };
      std::erase_if(all, [&](const auto& cell) { return !inside(cell.first); });
      for (const Position& q : points) {
        const CellIndex cell{static_cast<int64_t>(std::floor(q.x_m / p.cell_m)),
                             static_cast<int64_t>(std::floor(q.y_m / p.cell_m))};
        if (inside(cell) && q.z_m <= p.robot_height_m) all[cell].push_back(q);
      }
      std::vector<int16_t> cells(static_cast<size_t>(map.side()) * static_cast<size_t>(map.side()), 77);
      const takt::ImageView<int16_t> view{cells.data(), map.side(), map.side()};
      map.judge(view);
      const Reference reference{p, all};
      bool equal = true;
      for (int row = 0; row < map.side(); ++row)
        for (int column = 0; column < map.side(); ++column) {
          const int expected = reference.judge({column0 + column, row0 + row});
          equal &= view.at(column, row) == expected;
          ++count[expected == kUnknown ? 0 : expected == kFree ? 1 : 2];
        }
      CHECK(equal);
    }
  }
  for (const size_t kind : count) CHECK(kind >= takt::test::at_scale(500));
}
