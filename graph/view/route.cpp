// SPDX-License-Identifier: Apache-2.0
// Edges pass a column on a track in a gap between its boxes: the gap that is nearest to the straight line. Edges of the
// same output share their tracks. Between tracks they swing from one height to the other in the channel, where no box
// is.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "graph/view/layout_steps.hpp"
#include "graph/view/text_width.hpp"

namespace takt::view {
namespace {

constexpr double kEndless = 1e6;
constexpr double kChannelBase = 62, kChannelPerOutput = 5, kChannelMost = 170;
constexpr double kTurnBase = 30, kTurnStep = 7;

/// Free space in a column above `box` (none: below the last).
struct Gap {
  double low = -kEndless, high = kEndless;
  std::optional<size_t> box;
};

using OutputKey = std::pair<size_t, size_t>;  ///< box, output

/// One output's way through one gap.
struct Track {
  double wanted_sum = 0;
  int edges = 0;
  double y = 0;
};
using TrackKey = std::tuple<int, size_t, OutputKey>;  ///< column, gap, output

class Router {
 public:
  Router(const Diagram& diagram, const Arrangement& arrangement, const Placement& placement)
      : diagram_(diagram), arrangement_(arrangement), placement_(placement) {
    for (int column = 0; column < arrangement.columns; ++column) gaps_.push_back(gaps_of(column));
  }

  Routing route() {
    for (const DiagramEdge& edge : diagram_.edges) ways_.push_back(find_way(edge));
    assign_tracks();
    Routing result;
    result.needed = spacing();
    for (size_t e = 0; e < diagram_.edges.size(); ++e) result.edges.push_back(curves(e));
    return result;
  }

 private:
  using Way = std::vector<TrackKey>;  ///< one per column passed, from the producer on

  std::vector<Gap> gaps_of(int column) const {
    struct Obstacle {
      double top, bottom;
      size_t box;
    };
    std::vector<Obstacle> obstacles;
    for (size_t box = 0; box < diagram_.boxes.size(); ++box) {
      if (arrangement_.column[box] != column) continue;
      double top = placement_.boxes[box].y;
      if (under_title(box, column)) top = placement_.rooms[diagram_.boxes[box].room].y;
      obstacles.push_back({top, placement_.boxes[box].bottom(), box});
    }
    std::sort(obstacles.begin(), obstacles.end(), [](const auto& a, const auto& b) { return a.top < b.top; });
    std::vector<Gap> gaps(obstacles.size() + 1);
    for (size_t i = 0; i < obstacles.size(); ++i) {
      gaps[i].high = obstacles[i].top - kTrackClearance;
      gaps[i].box = obstacles[i].box;
      gaps[i + 1].low = obstacles[i].bottom + kTrackClearance;
    }
    return gaps;
  }

  /// The first box of a room in the room's first column stands below the room's title.
  bool under_title(size_t box, int column) const {
    const auto& columns = arrangement_.cells[diagram_.boxes[box].room];
    for (int c = 0; c < column; ++c)
      if (!columns[static_cast<size_t>(c)].empty()) return false;
    return columns[static_cast<size_t>(column)].front() == box;
  }

  /// Columns between producer and reader; an edge that does not go right also passes the columns of both.
  std::vector<int> columns_passed(const DiagramEdge& edge) const {
    const int from = arrangement_.column[edge.from_box], to = arrangement_.column[edge.to_box];
    std::vector<int> columns;
    if (from < to)
      for (int c = from + 1; c < to; ++c) columns.push_back(c);
    else
      for (int c = from; c >= to; --c) columns.push_back(c);
    return columns;
  }

  Way find_way(const DiagramEdge& edge) {
    const double start = start_of(placement_, edge).y, end = end_of(placement_, edge).y;
    const std::vector<int> columns = columns_passed(edge);
    Way way;
    double y = start;
    for (size_t i = 0; i < columns.size(); ++i) {
      const auto left = static_cast<double>(columns.size() - i);
      const double wanted = y + (end - y) / (left + 1);
      const auto& gaps = gaps_[static_cast<size_t>(columns[i])];
      const auto distance = [&](const Gap& gap) { return std::abs(std::clamp(wanted, gap.low, gap.high) - wanted); };
      const auto best = std::min_element(gaps.begin(), gaps.end(),
                                         [&](const Gap& a, const Gap& b) { return distance(a) < distance(b); });
      y = std::clamp(wanted, best->low, best->high);
      way.push_back({columns[i], static_cast<size_t>(best - gaps.begin()), {edge.from_box, edge.output}});
      Track& track = tracks_[way.back()];
      track.wanted_sum += y;
      ++track.edges;
    }
    return way;
  }

  /// Tracks of one gap side by side, in the order of their wanted heights.
  void assign_tracks() {
    std::map<std::pair<int, size_t>, std::vector<Track*>> by_gap;
    for (auto& [key, track] : tracks_) {
      track.y = track.wanted_sum / track.edges;
      by_gap[{std::get<0>(key), std::get<1>(key)}].push_back(&track);
    }
    for (auto& [place, tracks] : by_gap) {
      std::stable_sort(tracks.begin(), tracks.end(), [](const Track* a, const Track* b) { return a->y < b->y; });
      const Gap& gap = gaps_[static_cast<size_t>(place.first)][place.second];
      const auto between = static_cast<double>(tracks.size() - 1);
      const double spacing = tracks.size() > 1 ? std::min(kTrackSpacing, (gap.high - gap.low) / between) : 0;
      std::vector<double> wanted;
      for (const Track* track : tracks) wanted.push_back(track->y);
      const std::vector<double> zero(tracks.size(), 0), gaps(tracks.size(), spacing);
      const auto ys = stack(wanted, zero, gaps, gap.low, gap.high);
      for (size_t i = 0; i < tracks.size(); ++i) tracks[i]->y = ys[i];
    }
  }

  Spacing spacing() const {
    Spacing result{std::vector<double>(diagram_.boxes.size(), 0), std::vector<double>(diagram_.rooms.size(), 0), {}};
    std::map<std::pair<int, size_t>, int> count;
    for (const auto& [key, track] : tracks_) ++count[{std::get<0>(key), std::get<1>(key)}];
    for (const auto& [place, tracks] : count) {
      const Gap& gap = gaps_[static_cast<size_t>(place.first)][place.second];
      if (!gap.box || gap.low <= -kEndless) continue;  // above the first and below the last there is room
      const double need = 2 * kTrackClearance + (tracks - 1) * kTrackSpacing;
      const size_t room = diagram_.boxes[*gap.box].room;
      const bool first = arrangement_.cells[room][static_cast<size_t>(place.first)].front() == *gap.box;
      double& extra = first ? result.above_room[room] : result.above_box[*gap.box];
      extra = std::max(extra, need - (first ? kRoomPadding + kRoomGap : kBoxGap));
    }
    result.channel = channels();
    return result;
  }

  /// The more outputs swing from one height to another in a channel, the wider it is.
  std::vector<double> channels() const {
    std::vector<std::map<OutputKey, int>> outputs(static_cast<size_t>(arrangement_.columns));
    for (const DiagramEdge& edge : diagram_.edges) {
      const int from = arrangement_.column[edge.from_box], to = arrangement_.column[edge.to_box];
      for (int c = std::max(0, std::min(from, to - 1)); c <= std::max(from, to - 1); ++c)
        ++outputs[static_cast<size_t>(c)][{edge.from_box, edge.output}];
    }
    std::vector<double> widths;
    for (const auto& channel : outputs)
      widths.push_back(std::min(kChannelMost, kChannelBase + kChannelPerOutput * static_cast<double>(channel.size())));
    return widths;
  }

  /// From one height to the other within a channel; leaves and arrives level.
  static Curve swing(Point from, Point to) {
    const double middle = (from.x + to.x) / 2;
    return {from, {middle, from.y}, {middle, to.y}, to};
  }
  /// Back to where it came from, at another height; `reach` < 0 turns on the left.
  static Curve turn(Point from, Point to, double reach) {
    return {from, {from.x + reach, from.y}, {to.x + reach, to.y}, to};
  }

  std::vector<Curve> curves(size_t e) const {
    const DiagramEdge& edge = diagram_.edges[e];
    const bool forward = arrangement_.column[edge.from_box] < arrangement_.column[edge.to_box];
    std::vector<Curve> result;
    Point at = start_of(placement_, edge);
    const double reach = kTurnBase + kTurnStep * static_cast<double>(edge.output % 4);
    for (const TrackKey& key : ways_[e]) {
      const auto column = static_cast<size_t>(std::get<0>(key));
      const double y = tracks_.at(key).y;
      const double left = placement_.column_left[column], right = placement_.column_right[column];
      const Point in{forward ? left : right, y}, out{forward ? right : left, y};
      result.push_back(!forward && result.empty() ? turn(at, in, reach) : swing(at, in));
      result.push_back(swing(in, out));
      at = out;
    }
    const Point end = end_of(placement_, edge), tip{end.x - kArrowLength, end.y};
    if (forward) result.push_back(swing(at, tip));
    else result.push_back(turn({at.x, at.y}, tip, -reach));
    return result;
  }

  const Diagram& diagram_;
  const Arrangement& arrangement_;
  const Placement& placement_;
  std::vector<std::vector<Gap>> gaps_;  ///< by column, from above
  std::vector<Way> ways_;
  std::map<TrackKey, Track> tracks_;
};

}  // namespace

Routing route(const Diagram& diagram, const Arrangement& arrangement, const Placement& placement) {
  return Router(diagram, arrangement, placement).route();
}

}  // namespace takt::view
