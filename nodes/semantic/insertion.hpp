// SPDX-License-Identifier: Apache-2.0
// What becomes of an observation: merged with the object that it most probably is of, or a new object (thesis Sec.
// 5.2.3; ); and of objects whose place is seen free: removed, the thesis's future work.
#pragma once
#include "nodes/semantic/similarity.hpp"

namespace takt::semantic {

struct InsertionParameters {
  SimilarityParameters similarity;
  double merge_min = 0.75;  ///< p from which on two are one
  /// Two observations of one stamp are two objects. Not in the thesis; wants a detector that reports each object once.
  bool distinct_in_view = false;
  uint32_t weight_most = 10;   ///< a sighting moves the object by at least 1 / this of the way
  uint32_t misses = 5;         ///< looks in a row that see an object's place free before it is removed
  double free_radius_m = 0.3;  ///< all cells so near to the place must be seen free
};

enum class Outcome : uint8_t { merged, created, removed, refused };

/// One decision and what it rests on; names, since nodes may be gone when it is read.
struct Decision {
  Outcome outcome = Outcome::refused;
  NodeId object = kNoNode;                ///< removed: no longer valid
  char name[kLongestName + 1] = {};       ///< of the object; refused: of the type
  char candidate[kLongestName + 1] = {};  ///< most similar object; empty: none of the type was within reach
  bool named = false;                     ///< the observation had a name, which decides
  Comparison comparison;                  ///< with the candidate
  uint32_t sightings = 0, missed = 0;
  NetworkError error = NetworkError::full;  ///< of a refused one
};

/// From where, and how far, a sensor looked at that instant.
struct Look {
  double x_m = 0, y_m = 0;
  double direction_rad = 0;  ///< of the middle, from the map's x axis
  double half_angle_rad = 0.576, range_m = 5;
  int64_t stamp_ns = 0;
};

/// Memory is taken by the constructor. One thread at a time.
class Insertion {
 public:
  Insertion(SemanticMap& map, const InsertionParameters& parameters);
  /// From the next observation on.
  void tune(const InsertionParameters& parameters) {
    parameters_ = parameters;
    similarity_.tune(parameters.similarity);
  }

  /// Of equally similar candidates the one with the lower id. What has a name is the object of that name and type, or a
  /// new one; seen farther away than d_max it has been moved, and is where it was seen. Observed values replace older
  /// ones.
  Decision insert(const Observation& observation);

  /// Once for each look, after its observations were inserted: objects in sight that were not among them, and whose
  /// place `seen` shows free, are missed; on_removed(decision) for each that was missed too often.
  template <class OnRemoved>
  void forget(const Look& look, const navigation::OccupancyView& seen, OnRemoved on_removed) {
    find_missed(look, seen);
    for (const NodeId object : gone_) on_removed(remove(object));
  }

  const InsertionParameters& parameters() const { return parameters_; }

 private:
  NodeId most_similar(const Observation& observation, Comparison& comparison);
  NodeId namesake(const Observation& observation, Comparison& comparison);
  void find_missed(const Look& look, const navigation::OccupancyView& seen);
  Decision remove(NodeId object);
  void update(NodeId object, const Observation& observation);

  SemanticMap& map_;
  InsertionParameters parameters_;
  Similarity similarity_;
  std::vector<NodeId> gone_;
};

constexpr size_t kLongestReason = 200;
/// Writes as much as fits and returns what was written: "merged with chair_2, p = 0.83 >= 0.75: 0.62 m apart, colour
/// differs by 0.21". No allocation.
std::string_view explain(const SemanticMap& map, const Decision& decision, const InsertionParameters& parameters,
                         std::span<char> into);

}  // namespace takt::semantic
