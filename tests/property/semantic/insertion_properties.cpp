// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <map>
#include <random>
#include <set>

#include "nodes/semantic/insertion.hpp"
#include "tests/property_scale.hpp"

using namespace takt::semantic;

namespace {

/// p of Eq. 5.13 to 5.19 as corrected, from sets and maps; `d_max` 2 m, identities differ beyond 0.3.
double probability(const SemanticMap& map, const Observation& seen, NodeId object,
                   const std::map<std::pair<NodeId, NodeId>, double>& weights) {
  const auto& network = map.network();
  const double share = std::hypot(seen.x_m - map.object(object).x_m, seen.y_m - map.object(object).y_m) / 2;
  const auto has = [&](NodeId node, Kind kind) {
    const auto items = network.omega(node, kind);
    return std::set<NodeId>(items.begin(), items.end());
  };
  std::set<NodeId> of_seen = has(seen.type, Kind::attribute), of_object = has(object, Kind::attribute);
  std::map<NodeId, Value> values;
  for (const State& state : seen.states) of_seen.insert(state.attribute), values[state.attribute] = state.value;
  for (const NodeId type : has(object, Kind::type)) of_object.merge(has(type, Kind::attribute));
  std::set<NodeId> either = of_seen;
  either.insert(of_object.begin(), of_object.end());
  double sum = 0, weight_sum = 0;
  for (const NodeId attribute : either) {
    double d = 1;
    if (of_seen.contains(attribute) && of_object.contains(attribute)) {
      const Value a = values[attribute], b = map.state(object, attribute);
      if (!known(a) || !known(b)) continue;
      d = distance(map.attribute(attribute), a, b);
      if (map.attribute(attribute).identity && d > 0.3) return 0;
    }
    const auto weight = weights.find({seen.type, attribute});
    const double w = weight == weights.end() ? 1 : weight->second;
    sum += w * d, weight_sum += w;
  }
  return 1 - (std::min(1.0, share * share) + (weight_sum > 0 ? sum / weight_sum : 0)) / 2;
}

}  // namespace

TEST_CASE("what becomes of an observation is what a comparison with every object says") {
  std::mt19937 random(takt::test::seed(11));
  const auto below = [&](size_t n) { return static_cast<size_t>(random() % n); };
  const auto real = [&](double high) { return std::uniform_real_distribution<double>(0, high)(random); };
  size_t merged = 0, created = 0, apart = 0;
  for (int round = 0; round < takt::test::rounds(60); ++round) {
    SemanticMap map({{300, 1500}, 0.3, 40, 40, 0, 0});
    std::vector<NodeId> attributes, types;
    std::map<std::pair<NodeId, NodeId>, double> weights;
    attributes.push_back(*map.add_attribute("a", {ValueKind::scalar, "m", 0, 2, {}, false}));
    attributes.push_back(*map.add_attribute("b", {ValueKind::colour, "", 0, 1, {}, below(2) == 0}));
    attributes.push_back(*map.add_attribute("c", {ValueKind::boolean, "", 0, 1, {}, false}));
    attributes.push_back(*map.add_attribute("d", {ValueKind::enumerated, "", 0, 1, {"x", "y", "z"}, below(3) == 0}));
    for (const char* name : {"s", "t"}) {
      types.push_back(*map.add_type(name));
      for (const NodeId attribute : attributes)
        if (below(2) == 0) {
          weights[{types.back(), attribute}] = 0.5 + real(2);
          REQUIRE(map.add_to_type(types.back(), attribute, weights[{types.back(), attribute}]));
        }
    }
    const auto any_value = [&](size_t attribute) -> Value {
      const auto channel = [&] { return static_cast<float>(real(1)); };
      switch (attribute) {
        case 0: return real(2);
        case 1: return Rgb{channel(), channel(), channel()};
        case 2: return below(2) == 0;
        default: return Word{static_cast<uint16_t>(below(3))};
      }
    };
    Insertion insertion(map, {});
    for (int64_t stamp = 1; stamp <= 120; ++stamp) {
      std::vector<State> states;
      for (size_t i = 0; i < attributes.size(); ++i)
        if (below(4) == 0) states.push_back({attributes[i], below(5) == 0 ? Value{} : any_value(i)});
      const Observation seen{types[below(2)], 0.01 + real(8), 0.01 + real(8), 1, stamp, states};
      NodeId best = kNoNode;
      double p = 0;
      for (const NodeId object : map.all(Kind::object)) {
        const double away = std::hypot(map.object(object).x_m - seen.x_m, map.object(object).y_m - seen.y_m);
        if (away > 2 || !map.network().connected(object, seen.type)) continue;
        const double of_this = probability(map, seen, object, weights);
        if (best == kNoNode || of_this > p) best = object, p = of_this;
      }
      const std::string candidate(best == kNoNode ? "" : map.network().name(best));
      const Decision decision = insertion.insert(seen);
      REQUIRE(decision.candidate == candidate);
      REQUIRE(decision.comparison.p == p);
      REQUIRE((decision.outcome == Outcome::merged) == (best != kNoNode && p >= 0.75));
      if (decision.outcome == Outcome::merged) REQUIRE(decision.object == best);
      merged += decision.outcome == Outcome::merged;
      created += decision.outcome == Outcome::created;
      apart += decision.comparison.identity_differs;
      // Cells and objects name each other.
      const auto& now = map.object(decision.object);
      bool there = false;
      map.in_cell(map.grid().cell_of(now.x_m, now.y_m), [&](NodeId o) { there = there || o == decision.object; });
      REQUIRE(there);
    }
  }
  CHECK(merged >= takt::test::at_scale(1000));
  CHECK(created >= takt::test::at_scale(1000));
  CHECK(apart >= takt::test::at_scale(20));
}
