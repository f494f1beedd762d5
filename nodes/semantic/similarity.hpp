// SPDX-License-Identifier: Apache-2.0
// How probable it is that two descriptions are of one object (thesis Eq. 5.13 to 5.19; as
// corrected by C-5).
#pragma once
#include "nodes/semantic/semantic_map.hpp"

namespace takt::semantic {

struct SimilarityParameters {
  double distance_max_m = 2;  ///< d_max: so far apart the places say nothing for one object any more
  double identity_max = 0.3;  ///< attributes of identity that differ by more are of two objects
};

/// An object as somebody saw it; its attributes are those of its type and those observed.
struct Observation {
  NodeId type = kNoNode;
  double x_m = 0, y_m = 0;
  double confidence = 1;
  int64_t stamp_ns = 0;
  std::span<const State> states;
  std::string_view name = {};  ///< as whoever reports it calls it; empty: nobody has named it
};

/// p = 1 - (d0 + d1) / 2; d0 = min(1, (distance / d_max)^2); d1 the weighted mean of the attributes' distances.
struct Comparison {
  double p = 0;  ///< 0 of different types
  double distance_m = 0, d0 = 0, d1 = 0;
  NodeId farthest = kNoNode;  ///< the attribute that adds most to d1; none: nothing differs
  double farthest_distance = 0;
  bool same_types = false;
  bool identity_differs = false;  ///< p is then 0
};

/// Memory is taken by the constructor. One thread at a time.
class Similarity {
 public:
  Similarity(const SemanticMap& map, const SimilarityParameters& parameters);
  void tune(const SimilarityParameters& parameters) { parameters_ = parameters; }

  /// An attribute that only one of the two can have counts 1; one whose value is unknown on a side is left out, and the
  /// weights are those of the rest.
  Comparison compare(const Observation& observation, NodeId object);
  Comparison compare(NodeId a, NodeId b);

 private:
  struct Description {
    double x_m, y_m;
    std::span<const NodeId> types, attributes;
    std::span<const State> states;
  };
  Description describe(NodeId object, NodeSet& attributes) const;
  Comparison compare(const Description& a, const Description& b) const;

  const SemanticMap& map_;
  SimilarityParameters parameters_;
  NodeSet a_, b_;
};

}  // namespace takt::semantic
