// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/insertion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace takt::semantic {
namespace {

using navigation::Cell;
using navigation::OccupancyView;

bool in_sight(const Look& look, const Object& object) {
  const double bearing = std::atan2(object.y_m - look.y_m, object.x_m - look.x_m) - look.direction_rad;
  return std::abs(std::remainder(bearing, 2 * std::numbers::pi)) <= look.half_angle_rad;
}

bool seen_free(const OccupancyView& seen, double x_m, double y_m, double radius_m) {
  const Cell low = seen.cell_of(x_m - radius_m, y_m - radius_m), high = seen.cell_of(x_m + radius_m, y_m + radius_m);
  for (int row = low.row; row <= high.row; ++row)
    for (int column = low.column; column <= high.column; ++column) {
      const Cell cell{column, row};
      const bool own = cell == seen.cell_of(x_m, y_m);
      if (!own && std::hypot(seen.middle_x_m(cell) - x_m, seen.middle_y_m(cell) - y_m) > radius_m) continue;
      if (!seen.contains(cell)) return false;
      const int16_t p = seen.cells.at(column, row);
      if (p == navigation::kUnknownCell || p > navigation::kHalfOccupied) return false;
    }
  return true;
}

/// Text in memory of a fixed size; what does not fit is cut off.
class Text {
 public:
  explicit Text(std::span<char> into) : into_(into) {}
  template <class... T>
  void add(fmt::format_string<T...> form, T&&... values) {
    const auto left = into_.subspan(used_);
    used_ += std::min(left.size(), fmt::format_to_n(left.data(), left.size(), form, std::forward<T>(values)...).size);
  }
  std::string_view written() const { return {into_.data(), used_}; }

 private:
  std::span<char> into_;
  size_t used_ = 0;
};

void write_name(std::string_view name, char (&into)[kLongestName + 1]) { into[name.copy(into, kLongestName)] = '\0'; }

}  // namespace

Insertion::Insertion(SemanticMap& map, const InsertionParameters& parameters)
    : map_(map), parameters_(parameters), similarity_(map, parameters.similarity) {
  gone_.reserve(map.network().capacity());
}

/// kNoNode: none of its type is within reach.
NodeId Insertion::most_similar(const Observation& observation, Comparison& comparison) {
  NodeId best = kNoNode;
  map_.near(observation.x_m, observation.y_m, parameters_.similarity.distance_max_m, [&](NodeId object, double) {
    if (!map_.network().connected(object, observation.type)) return;
    if (parameters_.distinct_in_view && map_.object(object).seen_ns == observation.stamp_ns) return;
    const Comparison c = similarity_.compare(observation, object);
    if (best != kNoNode && (c.p < comparison.p || (c.p == comparison.p && object > best))) return;
    best = object;
    comparison = c;
  });
  return best;
}

/// kNoNode: there is none.
NodeId Insertion::namesake(const Observation& observation, Comparison& comparison) {
  const Network& network = map_.network();
  const NodeId node = network.find(observation.name);
  if (node == kNoNode || network.kind(node) != Kind::object || !network.connected(node, observation.type))
    return kNoNode;
  comparison = similarity_.compare(observation, node);
  return node;
}

Decision Insertion::insert(const Observation& observation) {
  Decision decision;
  decision.named = !observation.name.empty();
  NodeId best =
      decision.named ? namesake(observation, decision.comparison) : most_similar(observation, decision.comparison);
  if (best != kNoNode) write_name(map_.network().name(best), decision.candidate);

  const bool merge = best != kNoNode && (decision.named || decision.comparison.p >= parameters_.merge_min);
  if (!merge) {
    const auto created = map_.add_object(observation.type, observation.x_m, observation.y_m, observation.name);
    if (!created) {
      decision.error = created.error();
      write_name(map_.network().name(observation.type), decision.name);
      return decision;
    }
    best = *created;
    map_.object(best).first_ns = observation.stamp_ns;
  }
  decision.outcome = merge ? Outcome::merged : Outcome::created;
  decision.object = best;
  write_name(map_.network().name(best), decision.name);
  update(best, observation);
  decision.sightings = map_.object(best).sightings;
  return decision;
}

void Insertion::update(NodeId node, const Observation& observation) {
  Object& object = map_.object(node);
  const double moved_m = std::hypot(observation.x_m - object.x_m, observation.y_m - object.y_m);
  if (moved_m > parameters_.similarity.distance_max_m) object.sightings = 0;
  const double share = 1.0 / std::min(++object.sightings, parameters_.weight_most);
  object.seen_ns = observation.stamp_ns;
  object.confidence = observation.confidence;
  object.missed = 0;
  map_.move(node, object.x_m + share * (observation.x_m - object.x_m),
            object.y_m + share * (observation.y_m - object.y_m));
  for (const State& state : observation.states)
    if (known(state.value)) map_.set_state(node, state.attribute, state.value);
}

void Insertion::find_missed(const Look& look, const OccupancyView& seen) {
  gone_.clear();
  map_.near(look.x_m, look.y_m, look.range_m, [&](NodeId node, double) {
    Object& object = map_.object(node);
    if (object.seen_ns == look.stamp_ns || !in_sight(look, object)) return;
    if (!seen_free(seen, object.x_m, object.y_m, parameters_.free_radius_m)) return;
    if (++object.missed >= parameters_.misses) gone_.push_back(node);
  });
}

Decision Insertion::remove(NodeId node) {
  Decision decision;
  decision.outcome = Outcome::removed;
  decision.object = node;
  decision.sightings = map_.object(node).sightings;
  decision.missed = map_.object(node).missed;
  write_name(map_.network().name(node), decision.name);
  map_.remove(node);
  return decision;
}

std::string_view explain(const SemanticMap& map, const Decision& d, const InsertionParameters& parameters,
                         std::span<char> into) {
  Text text(into);
  const Comparison& c = d.comparison;
  const auto because = [&] {
    text.add(": {:.2f} m apart", c.distance_m);
    if (c.farthest == kNoNode) return;
    text.add(", {} differs by {:.2f}", map.network().name(c.farthest), c.farthest_distance);
    if (c.identity_differs) text.add(", which one object cannot");
  };
  switch (d.outcome) {
    case Outcome::merged:
      if (d.named) text.add("merged with {}, which has its name", d.name);
      else text.add("merged with {}, p = {:.2f} >= {:.2f}", d.name, c.p, parameters.merge_min);
      because();
      break;
    case Outcome::created:
      text.add("created {}: ", d.name);
      if (d.named) {
        text.add("nothing had its name");
      } else if (d.candidate[0] == '\0') {
        text.add("none of its type within {:g} m", parameters.similarity.distance_max_m);
      } else {
        text.add("most similar is {}, p = {:.2f} < {:.2f}", d.candidate, c.p, parameters.merge_min);
        because();
      }
      break;
    case Outcome::removed:
      text.add("removed {}: its place was seen free {} times in a row, after {} sightings", d.name, d.missed,
               d.sightings);
      break;
    case Outcome::refused: text.add("refused a {}: {}", d.name, to_string(d.error)); break;
  }
  return text.written();
}

}  // namespace takt::semantic
