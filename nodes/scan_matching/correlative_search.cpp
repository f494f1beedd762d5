// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/correlative_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr int kBlock = ScoreField::kBlock;

int blocks(int shifts) { return (2 * shifts + kBlock) / kBlock; }

}  // namespace

CorrelativeSearch::CorrelativeSearch(size_t points, const SearchParameters& parameters, double cell_m)
    : p_(parameters),
      cell_m_(cell_m),
      turns_(static_cast<int>(std::ceil(p_.reach_rad / p_.step_rad - 1e-9))),
      shifts_(static_cast<int>(std::ceil(p_.reach_m / cell_m - 1e-9))),
      most_points_(points),
      cells_(static_cast<size_t>(turns()) * points),
      counts_(static_cast<size_t>(turns())),
      turn_penalty_(static_cast<size_t>(turns())),
      shift_penalty_(static_cast<size_t>(shifts())) {
  heap_.reserve(static_cast<size_t>(turns() * blocks(shifts_) * blocks(shifts_)));
}

void CorrelativeSearch::prepare(const ScoreField& field, std::span<const SurfacePoint> points,
                                const Expected& expected) {
  const double full = 255.0 * static_cast<double>(points.size()) * p_.prior;
  const auto lost = [&](double off, double sigma) {
    return static_cast<int32_t>(std::lround(full * std::min(1e4, off * off / (sigma * sigma))));
  };
  for (int s = 0; s < shifts(); ++s)
    shift_penalty_[static_cast<size_t>(s)] = lost((s - shifts_) * cell_m_, expected.sigma_m);
  // No shift may leave the field, nor the blocks of a bound.
  const int margin = shifts_ + 2 * kBlock;
  for (int t = 0; t < turns(); ++t) {
    const double turn = (t - turns_) * p_.step_rad;
    turn_penalty_[static_cast<size_t>(t)] = lost(turn, expected.sigma_rad);
    const PlanarPose& at = expected.robot_in_map;
    const double c = std::cos(at.theta_rad + turn), s = std::sin(at.theta_rad + turn);
    size_t& count = counts_[static_cast<size_t>(t)] = 0;
    for (const SurfacePoint& p : points.first(std::min(points.size(), most_points_))) {
      const Cell cell{field.column(at.x_m + c * p.x_m - s * p.y_m), field.row(at.y_m + s * p.x_m + c * p.y_m)};
      if (std::min(cell.column, cell.row) < margin || std::max(cell.column, cell.row) >= field.cells() - margin)
        continue;
      cells_[static_cast<size_t>(t) * most_points_ + count++] = cell;
    }
  }
}

std::span<const CorrelativeSearch::Cell> CorrelativeSearch::cells(int turn) const {
  const auto t = static_cast<size_t>(turn);
  return {cells_.data() + t * most_points_, counts_[t]};
}

int32_t CorrelativeSearch::penalty(int turn, int column, int row) const {
  return turn_penalty_[static_cast<size_t>(turn)] + shift_penalty_[static_cast<size_t>(column)] +
         shift_penalty_[static_cast<size_t>(row)];
}

/// Of the shifts first .. first + kBlock - 1: that of the one nearest to none.
int32_t CorrelativeSearch::least_penalty(int first) const {
  return shift_penalty_[static_cast<size_t>(std::clamp(shifts_, first, std::min(first + kBlock, shifts()) - 1))];
}

CorrelativeSearch::Block CorrelativeSearch::bounded(const ScoreField& field, int turn, int column, int row) const {
  int32_t sum = 0;
  for (const Cell& cell : cells(turn)) sum += field.bound(cell.column + column - shifts_, cell.row + row - shifts_);
  return {sum - turn_penalty_[static_cast<size_t>(turn)] - least_penalty(column) - least_penalty(row), turn, column,
          row};
}

void CorrelativeSearch::offer(int32_t sum, int turn, int column, int row, Found& best) const {
  const int32_t lost = penalty(turn, column, row), score = sum - lost;
  const int32_t candidate = (turn * shifts() + row) * shifts() + column;
  const bool first = best.candidate < 0;
  if (!first && score < best.score) return;
  if (!first && score == best.score && (lost > best.penalty || (lost == best.penalty && candidate > best.candidate)))
    return;
  best.score = score;
  best.penalty = lost;
  best.candidate = candidate;
}

void CorrelativeSearch::expand(const ScoreField& field, const Block& block, Found& best) const {
  std::array<std::array<int32_t, kBlock>, kBlock> sums{};
  for (const Cell& cell : cells(block.turn)) {
    const int column = cell.column + block.column - shifts_, row = cell.row + block.row - shifts_;
    for (int y = 0; y < kBlock; ++y) {
      const uint8_t* from = field.cell(column, row + y);
      auto& to = sums[static_cast<size_t>(y)];
      for (size_t x = 0; x < kBlock; ++x) to[x] += from[x];
    }
  }
  for (int y = 0; y < kBlock && block.row + y < shifts(); ++y)
    for (int x = 0; x < kBlock && block.column + x < shifts(); ++x)
      offer(sums[static_cast<size_t>(y)][static_cast<size_t>(x)], block.turn, block.column + x, block.row + y, best);
}

PlanarPose CorrelativeSearch::pose_of(const Found& found, const PlanarPose& expected) const {
  const int column = found.candidate % shifts() - shifts_, row = found.candidate / shifts() % shifts() - shifts_,
            turn = found.candidate / (shifts() * shifts()) - turns_;
  return {expected.x_m + column * cell_m_, expected.y_m + row * cell_m_,
          wrapped(expected.theta_rad + turn * p_.step_rad)};
}

Found CorrelativeSearch::find(const ScoreField& field, std::span<const SurfacePoint> points, const Expected& expected) {
  prepare(field, points, expected);
  heap_.clear();
  for (int t = 0; t < turns(); ++t)
    for (int row = 0; row < shifts(); row += kBlock)
      for (int column = 0; column < shifts(); column += kBlock)
        heap_.push_back(bounded(field, t, column, row));  // within the reserved capacity
  std::make_heap(heap_.begin(), heap_.end());
  Found best;
  while (!heap_.empty() && (best.candidate < 0 || heap_.front().bound >= best.score)) {
    expand(field, heap_.front(), best);
    std::pop_heap(heap_.begin(), heap_.end());
    heap_.pop_back();
  }
  best.robot_in_map = pose_of(best, expected.robot_in_map);
  return best;
}

Found CorrelativeSearch::find_reference(const ScoreField& field, std::span<const SurfacePoint> points,
                                        const Expected& expected) {
  prepare(field, points, expected);
  Found best;
  for (int t = 0; t < turns(); ++t)
    for (int row = 0; row < shifts(); ++row)
      for (int column = 0; column < shifts(); ++column) {
        int32_t sum = 0;
        for (const Cell& cell : cells(t)) sum += field.at(cell.column + column - shifts_, cell.row + row - shifts_);
        offer(sum, t, column, row, best);
      }
  best.robot_in_map = pose_of(best, expected.robot_in_map);
  return best;
}

}  // namespace takt::scan_matching
