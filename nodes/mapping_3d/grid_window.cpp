// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/grid_window.hpp"

#include <algorithm>

#include "rt/transform/pose_math.hpp"

namespace takt::mapping_3d {

GridWindow::GridWindow(int views, const GridShape& shape)
    : shape_(shape), quarters_{2 * shape.cells, shape.origin_m, shape.cell_m / 2} {
  const auto cells = static_cast<size_t>(shape.cells) * static_cast<size_t>(shape.cells);
  ring_.resize(static_cast<size_t>(views));
  for (View& view : ring_) {
    view.cells.resize(cells);
    view.points.reserve(4 * cells);
  }
  sums_.resize(4 * cells);
  regridded_.resize(cells);
}

void GridWindow::keep(const ObstacleGrid& grid, std::span<const Point> points, const Viewpoint& viewpoint,
                      const Transform& robot_in_map, ImageView<const int16_t> cells) {
  newest_ = (newest_ + 1) % ring_.size();
  views_ = std::min(views_ + 1, ring_.size());
  View& view = ring_[newest_];
  view.robot_in_map = robot_in_map;
  for (int row = 0; row < shape_.cells; ++row)
    for (int column = 0; column < shape_.cells; ++column)
      view.cells[static_cast<size_t>(row) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column)] =
          cells.at(column, row);
  reduce(grid, points, viewpoint, view);
}

void GridWindow::reduce(const ObstacleGrid& grid, std::span<const Point> points, const Viewpoint& viewpoint,
                        View& view) {
  std::fill(sums_.begin(), sums_.end(), Quarter{});
  const Affine camera = to_affine(viewpoint.camera_in_robot);
  for (const Point& point : points) {
    const Position p = transformed(camera, point.x, point.y, point.z);
    int column, row;
    if (!grid.blocked_at(p.x_m, p.y_m, p.z_m) || !quarters_.cell_of(p.x_m, p.y_m, column, row)) continue;
    Quarter& q = sums_[static_cast<size_t>(row) * static_cast<size_t>(quarters_.cells) + static_cast<size_t>(column)];
    q.x += p.x_m;
    q.y += p.y_m;
    q.z += p.z_m;
    ++q.points;
  }
  const Affine to_map = to_affine(view.robot_in_map);
  view.points.clear();
  for (const Quarter& q : sums_) {
    if (q.points == 0) continue;
    const double n = q.points;
    view.points.push_back(transformed(to_map, q.x / n, q.y / n, q.z / n));  // within the reserved capacity
  }
}

void GridWindow::resume(std::span<const int16_t> cells, const Transform& robot_in_map) {
  newest_ = (newest_ + 1) % ring_.size();
  views_ = std::min(views_ + 1, ring_.size());
  View& view = ring_[newest_];
  view.robot_in_map = robot_in_map;
  std::copy(cells.begin(), cells.end(), view.cells.begin());
  view.points.clear();
  const Affine to_map = to_affine(robot_in_map);
  for (int row = 0; row < quarters_.cells; ++row)
    for (int column = 0; column < quarters_.cells; ++column)
      if (cells[static_cast<size_t>(row / 2) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column / 2)] ==
          kOccupied)
        view.points.push_back(transformed(to_map, quarters_.origin_m + (column + 0.5) * quarters_.cell_m,
                                          quarters_.origin_m + (row + 0.5) * quarters_.cell_m, 0));
}

void GridWindow::remember(StateArchive& archive) {
  TAKT_STATE(archive, newest_, views_);
  if (newest_ >= ring_.size() || views_ > ring_.size()) return archive.fail();
  for (const View& unused : std::span(ring_).subspan(views_))
    archive.room(sizeof unused + unused.cells.size() * sizeof(int16_t) + unused.points.capacity() * sizeof(Position));
  for (size_t age = 0; age < views_; ++age) {
    View& view = ring_[(newest_ + ring_.size() - age) % ring_.size()];
    archive(view);
    if (view.cells.size() != regridded_.size()) return archive.fail();
  }
}

void GridWindow::regrid(const View& old, const Transform& robot_in_map) {
  const UncertainPose from_map = inverse({robot_in_map, {}});
  const Affine to_robot = to_affine(from_map.transform);
  const Affine to_old = to_affine(inverse(compose(from_map, {old.robot_in_map, {}})).transform);
  int column = 0, row = 0;
  size_t cell = 0;
  for (int w = 0; w < shape_.cells; ++w)
    for (int c = 0; c < shape_.cells; ++c, ++cell) {
      const Position centre = transformed(to_old, shape_.origin_m + (c + 0.5) * shape_.cell_m,
                                          shape_.origin_m + (w + 0.5) * shape_.cell_m, 0);
      const bool inside = shape_.cell_of(centre.x_m, centre.y_m, column, row);
      const auto at = static_cast<size_t>(row) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column);
      regridded_[cell] = inside && old.cells[at] == kFree ? kFree : kUnknown;
    }
  for (const Position& point : old.points) {
    const Position p = transformed(to_robot, point.x_m, point.y_m, point.z_m);
    if (shape_.cell_of(p.x_m, p.y_m, column, row))
      regridded_[static_cast<size_t>(row) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column)] =
          kOccupied;
  }
}

void GridWindow::merge_older(ImageView<int16_t> cells) {
  for (size_t age = 1; age < views_; ++age) {
    regrid(ring_[(newest_ + ring_.size() - age) % ring_.size()], ring_[newest_].robot_in_map);
    merge({regridded_.data(), shape_.cells, shape_.cells}, cells);
  }
}

}  // namespace takt::mapping_3d
