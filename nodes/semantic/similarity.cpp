// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/similarity.hpp"

#include <algorithm>

namespace takt::semantic {
namespace {

Value value_of(std::span<const State> states, NodeId attribute) {
  for (const State& state : states)
    if (state.attribute == attribute) return state.value;
  return {};
}

}  // namespace

Similarity::Similarity(const SemanticMap& map, const SimilarityParameters& parameters)
    : map_(map),
      parameters_(parameters),
      a_(map.network().capacity() + kMostStates),
      b_(map.network().capacity() + kMostStates) {}

Similarity::Description Similarity::describe(NodeId node, NodeSet& attributes) const {
  const Object& object = map_.object(node);
  map_.network().psi(node, Kind::attribute, attributes);
  return {object.x_m, object.y_m, map_.network().omega(node, Kind::type), attributes.items(),
          std::span(object.states).first(object.state_count)};
}

Comparison Similarity::compare(const Observation& observation, NodeId object) {
  a_.clear();
  a_.add(map_.network().omega(observation.type, Kind::attribute));
  for (const State& state : observation.states) a_.add({&state.attribute, 1});
  return compare({observation.x_m, observation.y_m, {&observation.type, 1}, a_.items(), observation.states},
                 describe(object, b_));
}

Comparison Similarity::compare(NodeId a, NodeId b) {
  const Description first = describe(a, a_);
  return compare(first, describe(b, b_));
}

Comparison Similarity::compare(const Description& a, const Description& b) const {
  Comparison c;
  c.distance_m = std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  c.same_types = std::equal(a.types.begin(), a.types.end(), b.types.begin(), b.types.end());
  if (!c.same_types) return c;  // s = 2, where the thesis prints 0

  const double share = c.distance_m / parameters_.distance_max_m;
  c.d0 = std::min(1.0, share * share);
  double weights = 0, most = 0;
  const auto count = [&](NodeId attribute, double d) {
    const double weight = map_.weight(a.types, attribute);
    weights += weight;
    c.d1 += weight * d;
    if (weight * d <= most) return;
    most = weight * d;
    c.farthest = attribute;
    c.farthest_distance = d;
  };
  auto of_a = a.attributes.begin(), of_b = b.attributes.begin();
  while (of_a != a.attributes.end() || of_b != b.attributes.end()) {
    if (of_b == b.attributes.end() || (of_a != a.attributes.end() && *of_a < *of_b)) {
      count(*of_a++, 1);
    } else if (of_a == a.attributes.end() || *of_b < *of_a) {
      count(*of_b++, 1);
    } else {
      const Value in_a = value_of(a.states, *of_a), in_b = value_of(b.states, *of_b);
      if (known(in_a) && known(in_b)) {
        const Attribute& attribute = map_.attribute(*of_a);
        const double d = distance(attribute, in_a, in_b);
        c.identity_differs = c.identity_differs || (attribute.identity && d > parameters_.identity_max);
        count(*of_a, d);
      }
      ++of_a, ++of_b;
    }
  }
  if (weights > 0) c.d1 /= weights;
  c.p = c.identity_differs ? 0 : 1 - (c.d0 + c.d1) / 2;
  return c;
}

}  // namespace takt::semantic
