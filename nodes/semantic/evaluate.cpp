// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/evaluate.hpp"

#include <algorithm>
#include <map>
#include <numbers>

namespace takt::semantic {
namespace {

constexpr const char* kTypes[] = {"chair", "table", "cupboard", "person"};
constexpr double kHeights_m[] = {0.9, 0.75, 1.9, 1.75};
constexpr Rgb kColours[] = {{0.8F, 0.1F, 0.1F}, {0.9F, 0.8F, 0.1F}, {0.1F, 0.6F, 0.2F},
                            {0.1F, 0.2F, 0.8F}, {0.9F, 0.9F, 0.9F}, {0.1F, 0.1F, 0.1F}};
constexpr double kHighest_m = 2.5, kCell_m = 0.3, kObjectRadius_m = 0.25;
constexpr double kPlaceMargin_m = 0.6;          // about a place: more than the free cells that removal asks for
constexpr int64_t kLookEvery_ns = 142'857'143;  // 7 Hz

/// Ids are those that empty_map() gives, in this order.
enum : NodeId { kColour, kHeight, kFirstType };

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
double gauss(std::mt19937_64& random, double sigma) { return std::normal_distribution<double>(0, sigma)(random); }

/// Whether all within `margin_m` of a place is.
bool in_view(const Look& look, double x_m, double y_m, double margin_m = 0) {
  const double distance_m = std::hypot(x_m - look.x_m, y_m - look.y_m);
  const double bearing_rad =
      std::remainder(std::atan2(y_m - look.y_m, x_m - look.x_m) - look.direction_rad, 2 * std::numbers::pi);
  const double margin_rad = std::asin(std::min(1.0, margin_m / std::max(distance_m, 1e-6)));
  return distance_m + margin_m <= look.range_m && std::abs(bearing_rad) + margin_rad <= look.half_angle_rad;
}

}  // namespace

GeneratedRoom::GeneratedRoom(const RoomParameters& p, uint64_t seed) : parameters_(p), random_(seed) {
  while (truth_.size() < p.objects) {
    TrueObject o;
    const size_t type = random_() % std::size(kTypes);
    o.type = static_cast<NodeId>(kFirstType + type);
    o.x_m = uniform(random_, 0.5, p.width_m - 0.5);
    o.y_m = uniform(random_, 0.5, p.height_m - 0.5);
    o.colour = kColours[random_() % std::size(kColours)];
    o.height_m = kHeights_m[type] * uniform(random_, 0.9, 1.1);
    const bool apart = std::all_of(truth_.begin(), truth_.end(), [&](const TrueObject& other) {
      return std::hypot(other.x_m - o.x_m, other.y_m - o.y_m) >= p.spacing_m;
    });
    if (apart) truth_.push_back(o);
  }
  const auto columns = static_cast<int>(p.width_m / kCell_m) + 1, rows = static_cast<int>(p.height_m / kCell_m) + 1;
  cells_.resize(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  now_.seen = {{cells_.data(), columns, rows}, kCell_m, 0, 0};
}

SemanticMap GeneratedRoom::empty_map() const {
  MapParameters p;
  p.capacity = {20 * parameters_.objects + 100, 100 * parameters_.objects + 100};
  p.origin_x_m = p.origin_y_m = -3;
  p.columns = static_cast<int>((parameters_.width_m + 6) / p.cell_m) + 1;
  p.rows = static_cast<int>((parameters_.height_m + 6) / p.cell_m) + 1;
  SemanticMap map(p);
  map.add_attribute("colour", {ValueKind::colour, "", 0, 1, {}, false});
  map.add_attribute("height", {ValueKind::scalar, "m", 0, kHighest_m, {}, false});
  for (const char* name : kTypes) {
    const NodeId type = *map.add_type(name);
    map.add_to_type(type, kColour);
    map.add_to_type(type, kHeight);
  }
  return map;
}

const RoomLook& GeneratedRoom::next() {
  const RoomParameters& p = parameters_;
  if (looks_ == p.looks / 2)
    for (size_t i = 0; i < std::min(p.vanish, truth_.size()); ++i) truth_[i].there = false;
  const double turn = 4 * std::numbers::pi * static_cast<double>(looks_) / static_cast<double>(p.looks);
  Look& look = now_.look;
  look.x_m = p.width_m / 2 + p.width_m / 3 * std::cos(turn);
  look.y_m = p.height_m / 2 + p.height_m / 4 * std::sin(turn);
  look.direction_rad = turn * 3.5;  // it looks about
  look.stamp_ns = static_cast<int64_t>(++looks_) * kLookEvery_ns;
  now_.observations.clear();
  now_.truth.clear();
  now_.states.clear();
  now_.states.reserve(truth_.size());
  for (size_t i = 0; i < truth_.size(); ++i) see(i);
  draw_free();
  return now_;
}

void GeneratedRoom::see(size_t object) {
  const TrueObject& o = truth_[object];
  if (!o.there || !in_view(now_.look, o.x_m, o.y_m) || uniform(random_, 0, 1) > parameters_.detected) return;
  const auto channel = [&](float value) {
    return static_cast<float>(std::clamp(value + gauss(random_, parameters_.colour_noise), 0.0, 1.0));
  };
  const auto reported = [&](Value value) {
    return uniform(random_, 0, 1) < parameters_.attribute_known ? value : Value{};
  };
  now_.states.push_back(
      {{{kColour, reported(Rgb{channel(o.colour.r), channel(o.colour.g), channel(o.colour.b)})},
        {kHeight, reported(std::clamp(o.height_m + gauss(random_, parameters_.height_noise_m), 0.0, kHighest_m))}}});
  now_.truth.push_back(object);
  now_.observations.push_back({o.type, o.x_m + gauss(random_, parameters_.noise_m),
                               o.y_m + gauss(random_, parameters_.noise_m), 1, now_.look.stamp_ns, now_.states.back()});
}

/// What a range sensor makes of the look: free as far as it sees, but for the things that stand there.
void GeneratedRoom::draw_free() {
  for (int row = 0; row < now_.seen.cells.height; ++row)
    for (int column = 0; column < now_.seen.cells.width; ++column) {
      const double x = now_.seen.middle_x_m({column, row}), y = now_.seen.middle_y_m({column, row});
      const bool stands = std::any_of(truth_.begin(), truth_.end(), [&](const TrueObject& o) {
        return o.there && std::hypot(o.x_m - x, o.y_m - y) <= kObjectRadius_m;
      });
      cells_[static_cast<size_t>(row) * static_cast<size_t>(now_.seen.cells.width) + static_cast<size_t>(column)] =
          !in_view(now_.look, x, y) ? navigation::kUnknownCell
          : stands                  ? int16_t{1000}
                                    : int16_t{0};
    }
}

RoomFigures measure_room(const RoomParameters& parameters, const InsertionParameters& insertion_parameters,
                         uint64_t seed, bool use_states,
                         const std::function<void(const SemanticMap&, const Decision&)>& told) {
  GeneratedRoom room(parameters, seed);
  SemanticMap map = room.empty_map();
  Insertion insertion(map, insertion_parameters);
  RoomFigures figures;
  // Sightings of true objects by node. Nodes that are gone are kept apart: their ids may be given anew.
  using Counts = std::map<size_t, size_t>;
  std::map<NodeId, Counts> nodes;
  std::vector<bool> seen(parameters.objects), known(parameters.objects);
  std::vector<size_t> looked_for(parameters.objects);  ///< looks at the place of one that is gone
  std::vector<size_t> removed_of;
  const auto owner = [](const Counts& counts) {
    return std::max_element(counts.begin(), counts.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  };
  const auto owned = [&] {
    std::map<size_t, std::vector<NodeId>> of;
    for (const auto& [node, counts] : nodes) of[owner(counts)].push_back(node);
    return of;
  };

  for (size_t k = 0; k < parameters.looks; ++k) {
    if (k == parameters.looks / 2)
      for (const auto& [truth, of] : owned()) known[truth] = true;
    const RoomLook& look = room.next();
    for (size_t i = 0; i < parameters.objects; ++i) {
      const TrueObject& truth = room.truth()[i];
      looked_for[i] += !truth.there && known[i] && in_view(look.look, truth.x_m, truth.y_m, kPlaceMargin_m);
    }
    for (size_t i = 0; i < look.observations.size(); ++i) {
      Observation observation = look.observations[i];
      if (!use_states) observation.states = {};
      const Decision decision = insertion.insert(observation);
      if (told) told(map, decision);
      if (decision.outcome == Outcome::refused) continue;
      const size_t truth = look.truth[i];
      seen[truth] = true;
      ++figures.sightings;
      Counts& counts = nodes[decision.object];
      ++counts[truth];
      figures.false_merges += decision.outcome == Outcome::merged && owner(counts) != truth;
    }
    insertion.forget(look.look, look.seen, [&](const Decision& decision) {
      if (told) told(map, decision);
      removed_of.push_back(owner(nodes[decision.object]));
      nodes.erase(decision.object);
    });
  }

  const auto of = owned();
  for (size_t i = 0; i < parameters.objects; ++i) {
    const TrueObject& truth = room.truth()[i];
    const auto mine = of.find(i);
    if (!truth.there) {
      const bool looked = looked_for[i] >= insertion_parameters.misses;
      figures.vanished += looked;
      figures.removed += looked && mine == of.end();
      continue;
    }
    figures.wrongly_removed += static_cast<size_t>(std::count(removed_of.begin(), removed_of.end(), i));
    if (!seen[i]) continue;
    ++figures.seen;
    if (mine == of.end()) {
      ++figures.swallowed;
      continue;
    }
    ++figures.found;
    figures.duplicates += mine->second.size() - 1;
    const NodeId best = *std::max_element(mine->second.begin(), mine->second.end(), [&](NodeId a, NodeId b) {
      return map.object(a).sightings < map.object(b).sightings;
    });
    figures.position_m.push_back(std::hypot(map.object(best).x_m - truth.x_m, map.object(best).y_m - truth.y_m));
  }
  return figures;
}

RoomFigures measure_rooms(const RoomParameters& room, const InsertionParameters& insertion, uint64_t seed, size_t rooms,
                          bool use_states) {
  RoomFigures sum;
  for (size_t i = 0; i < rooms; ++i) {
    const RoomFigures one = measure_room(room, insertion, seed + i, use_states);
    for (const auto member : {&RoomFigures::seen, &RoomFigures::found, &RoomFigures::duplicates,
                              &RoomFigures::swallowed, &RoomFigures::sightings, &RoomFigures::false_merges,
                              &RoomFigures::vanished, &RoomFigures::removed, &RoomFigures::wrongly_removed})
      sum.*member += one.*member;
    sum.position_m.insert(sum.position_m.end(), one.position_m.begin(), one.position_m.end());
  }
  return sum;
}

}  // namespace takt::semantic
