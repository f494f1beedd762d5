// SPDX-License-Identifier: Apache-2.0
// Edges pass a column on a track in a gap between its boxes, chosen so that they move up and down as little as
// possible. Edges of the same output share their tracks. Between tracks they swing from one height to the other in the
// channel, where no box is.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "graph/view/layout_steps.hpp"

namespace takt::view {
namespace {

constexpr double kEndless = 1e6;
constexpr double kChannelBase = 62, kChannelPerOutput = 5, kChannelMost = 170;
constexpr double kFrameClearance = 6;  // from passing edges to the frame of a room
constexpr double kShare = 40;          // edges of an output that pass within this height share a track
constexpr double kBendCost = 12;       // px of movement that one bend more is worth
constexpr double kTurnBase = 30, kTurnStep = 7;

/// Free space in a column: above a box, below the last box of a room, or between rooms. Its ends keep clear of boxes
/// and of the rooms' frames.
struct Gap {
  enum class Where : uint8_t { above_box, below_room, above_room, open } where = Where::open;
  size_t of = 0;  ///< the box or room that moves down if more edges pass than fit
  double low = -kEndless, high = kEndless;
};

using OutputKey = std::pair<size_t, size_t>;  ///< box, output

/// One output's way through one gap.
struct Track {
  double wanted_sum = 0;
  int edges = 0;
  double y = 0;
};
using TrackKey = std::tuple<int, size_t, OutputKey, long>;  ///< column, gap, output, height in steps

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
    std::vector<size_t> rooms;
    for (size_t room = 0; room < diagram_.rooms.size(); ++room)
      if (column >= first_column(room) && column <= last_column(room)) rooms.push_back(room);
    std::sort(rooms.begin(), rooms.end(),
              [&](size_t a, size_t b) { return placement_.rooms[a].y < placement_.rooms[b].y; });
    std::vector<Gap> gaps;
    double low = -kEndless;
    for (const size_t room : rooms) {
      const Rect& frame = placement_.rooms[room];
      const bool topmost = gaps.empty();
      gaps.push_back({topmost ? Gap::Where::open : Gap::Where::above_room, room, low, frame.y - kFrameClearance});
      add_gaps_inside(gaps, room, column);
      low = frame.bottom() + kFrameClearance;
    }
    gaps.push_back({Gap::Where::open, 0, low, kEndless});
    return gaps;
  }

  void add_gaps_inside(std::vector<Gap>& gaps, size_t room, int column) const {
    const Rect& frame = placement_.rooms[room];
    double low = frame.y + kFrameClearance;
    for (const size_t box : cell(room, column)) {
      const Rect& rect = placement_.boxes[box];
      // Where the room's title stands no edge passes.
      const bool below_title = box == cell(room, column).front() && column == first_column(room);
      if (!below_title) gaps.push_back({Gap::Where::above_box, box, low, rect.y - kTrackClearance});
      low = rect.bottom() + kTrackClearance;
    }
    gaps.push_back({Gap::Where::below_room, room, low, frame.bottom() - kFrameClearance});
  }

  const std::vector<size_t>& cell(size_t room, int column) const {
    return arrangement_.cells[room][static_cast<size_t>(column)];
  }
  /// Beyond the last column for a room without boxes.
  int first_column(size_t room) const {
    int column = 0;
    while (column < arrangement_.columns && cell(room, column).empty()) ++column;
    return column;
  }
  int last_column(size_t room) const {
    int column = arrangement_.columns - 1;
    while (column >= 0 && cell(room, column).empty()) --column;
    return column;
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

  /// A height at which an edge may pass a column, and the best way to it.
  struct Stop {
    size_t gap = 0;
    double y = 0, cost = 0;
    size_t before = 0;  ///< stop in the column passed before
  };

  /// Per gap the heights where an edge can go on level, from the start or to the end, and the gap's ends.
  std::vector<Stop> stops_of(int column, double start, double end) const {
    std::vector<Stop> stops;
    const auto& gaps = gaps_[static_cast<size_t>(column)];
    for (size_t gap = 0; gap < gaps.size(); ++gap)
      for (const double y : {start, end, gaps[gap].low, gaps[gap].high})
        stops.push_back({gap, std::clamp(y, gaps[gap].low, gaps[gap].high), 0, 0});
    return stops;
  }

  static double move_cost(double from, double to) { return std::abs(from - to) + (from == to ? 0 : kBendCost); }

  /// The way with the least movement up and down, and few bends: shortest path over the stops, column by column.
  Way find_way(const DiagramEdge& edge) {
    const double start = start_of(placement_, edge).y, end = end_of(placement_, edge).y;
    const std::vector<int> columns = columns_passed(edge);
    std::vector<std::vector<Stop>> layers{{{0, start, 0, 0}}};
    for (const int column : columns) {
      std::vector<Stop> stops = stops_of(column, start, end);
      for (Stop& stop : stops) {
        stop.cost = std::numeric_limits<double>::infinity();
        for (size_t i = 0; i < layers.back().size(); ++i)
          if (const double cost = layers.back()[i].cost + move_cost(layers.back()[i].y, stop.y); cost < stop.cost)
            stop.cost = cost, stop.before = i;
      }
      layers.push_back(std::move(stops));
    }
    const auto& last = layers.back();
    auto at = static_cast<size_t>(std::min_element(last.begin(), last.end(),
                                                   [&](const Stop& a, const Stop& b) {
                                                     return a.cost + move_cost(a.y, end) < b.cost + move_cost(b.y, end);
                                                   }) -
                                  last.begin());
    Way way;
    for (size_t layer = columns.size(); layer > 0; at = layers[layer][at].before, --layer) {
      const Stop& stop = layers[layer][at];
      way.insert(way.begin(),
                 {columns[layer - 1], stop.gap, {edge.from_box, edge.output}, std::lround(stop.y / kShare)});
      Track& track = tracks_[way.front()];
      track.wanted_sum += stop.y;
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

  /// What moves down so that every gap holds the edges that chose it.
  Spacing spacing() const {
    const std::vector<double> none(diagram_.rooms.size(), 0);
    Spacing result{std::vector<double>(diagram_.boxes.size(), 0), none, none, channels()};
    std::map<std::pair<int, size_t>, int> count;
    for (const auto& [key, track] : tracks_) ++count[{std::get<0>(key), std::get<1>(key)}];
    for (const auto& [place, tracks] : count) {
      const Gap& gap = gaps_[static_cast<size_t>(place.first)][place.second];
      const double lacks = (tracks - 1) * kTrackSpacing - (gap.high - gap.low);
      const auto widen = [&](double& extra) { extra = std::max(extra, lacks); };
      if (gap.where == Gap::Where::above_box) widen(result.above_box[gap.of]);
      if (gap.where == Gap::Where::above_room) widen(result.above_room[gap.of]);
      if (gap.where == Gap::Where::below_room) widen(result.below_room[gap.of]);
    }
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
