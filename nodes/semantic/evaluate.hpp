// SPDX-License-Identifier: Apache-2.0
// A room of objects seen with noise by a robot that drives through it, and what a map makes of that (thesis Sec. 5.4,
// the experiments of Fig. 5.10 and 5.11 rebuilt): for `takt eval semantic`, the benchmark and the tests.
#pragma once
#include <functional>
#include <random>

#include "nodes/semantic/insertion.hpp"

namespace takt::semantic {

struct RoomParameters {
  size_t objects = 30;
  double width_m = 20, height_m = 12;
  double spacing_m = 1.0;        ///< between two objects at least
  size_t looks = 300;            ///< along an ellipse, twice round
  double noise_m = 0.3;          ///< of a place, standard deviation in each direction
  double detected = 0.9;         ///< share of the objects in view that a look reports
  double attribute_known = 0.7;  ///< share of the reported attributes that have a value
  double colour_noise = 0.06, height_noise_m = 0.05;
  size_t vanish = 4;  ///< objects that are taken away at half time
};

/// What is really there.
struct TrueObject {
  NodeId type = kNoNode;
  double x_m = 0, y_m = 0;
  Rgb colour;
  double height_m = 0;
  bool there = true;
};

/// What one look reports, and of which true objects.
struct RoomLook {
  Look look;
  std::vector<Observation> observations;
  std::vector<size_t> truth;
  std::vector<std::array<State, 2>> states;  ///< of the observations
  navigation::OccupancyView seen;
};

/// Types chair, table, cupboard and person, each with a colour and a height. The same seed gives the same room.
class GeneratedRoom {
 public:
  GeneratedRoom(const RoomParameters& parameters, uint64_t seed);
  /// A map that knows the types and nothing else.
  SemanticMap empty_map() const;
  /// The next look; valid until the one after.
  const RoomLook& next();
  const std::vector<TrueObject>& truth() const { return truth_; }

 private:
  void see(size_t object);
  void draw_free();

  RoomParameters parameters_;
  std::mt19937_64 random_;
  std::vector<TrueObject> truth_;
  RoomLook now_;
  size_t looks_ = 0;
  std::vector<int16_t> cells_;
};

struct RoomFigures {
  size_t seen = 0;                         ///< true objects with a sighting, the vanished ones left out
  size_t found = 0;                        ///< of those, with a node most of whose sightings are of them
  size_t duplicates = 0;                   ///< nodes beyond the first of an object
  size_t swallowed = 0;                    ///< seen and without a node of their own
  size_t sightings = 0, false_merges = 0;  ///< false: merged into a node that is another object's
  size_t vanished = 0;             ///< taken away after they were found, and looked for often enough to be missed
  size_t removed = 0;              ///< of those, without a node at the end
  size_t wrongly_removed = 0;      ///< nodes of objects that are still there
  std::vector<double> position_m;  ///< errors of the found
};

/// One room, looked at to the end. `use_states` false: places and types alone decide. `told` hears of each decision.
RoomFigures measure_room(const RoomParameters& room, const InsertionParameters& insertion, uint64_t seed,
                         bool use_states = true,
                         const std::function<void(const SemanticMap&, const Decision&)>& told = {});
/// Figures of several rooms together, seeds `seed`, `seed` + 1, ...
RoomFigures measure_rooms(const RoomParameters& room, const InsertionParameters& insertion, uint64_t seed, size_t rooms,
                          bool use_states = true);

}  // namespace takt::semantic
