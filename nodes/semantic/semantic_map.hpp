// SPDX-License-Identifier: Apache-2.0
// The semantic map: an occupancy grid with terrain, the semantic network, and links between cells and objects both ways
// (thesis Sec. 5.2.1, 5.2.2; R-10).
#pragma once
#include <optional>

#include "nodes/navigation/occupancy_view.hpp"
#include "nodes/semantic/attribute.hpp"
#include "nodes/semantic/network.hpp"
#include "rt/state_archive.hpp"

namespace takt::semantic {

/// chi(o, a): the value of one attribute of one object (Eq. 5.9).
struct State {
  NodeId attribute = kNoNode;
  Value value;
};
constexpr size_t kMostStates = 12;  ///< known ones of one object

struct Object {
  double x_m = 0, y_m = 0;
  double confidence = 0;                ///< 0..1, as whoever reported it gave it
  int64_t first_ns = -1, seen_ns = -1;  ///< stamps of the first and the last sighting; -1: there was none
  uint32_t sightings = 0;
  uint32_t missed = 0;  ///< looks in a row that saw its place free
  uint32_t cell = 0;
  NodeId next = kNoNode, previous = kNoNode;  ///< in the same cell
  uint32_t state_count = 0;
  std::array<State, kMostStates> states;  ///< the known ones
};

struct Role {
  std::string name;
  NodeId type = kNoNode;
};
/// The value that an attribute of the object in a role must have, or gets.
struct Clause {
  uint32_t role = 0;  ///< index into Action::roles
  NodeId attribute = kNoNode;
  Value value;
};
/// Lambda_c (thesis Eq. 5.12): where all of `required` hold, `results` come true; what is not named stays.
struct Action {
  std::vector<Role> roles;
  std::vector<Clause> required, results;
  double cost_s = 0;
};

/// 0: nothing was seen there.
using Terrain = uint8_t;

struct MapParameters {
  NetworkCapacity capacity{20'000, 60'000};
  double cell_m = 0.3;
  int columns = 700, rows = 700;
  double origin_x_m = -105, origin_y_m = -105;  ///< corner of cell (0, 0)
};

/// Memory is taken by the constructor and by what is added from a file; objects come and go without. One thread at a
/// time.
class SemanticMap {
 public:
  explicit SemanticMap(const MapParameters& parameters);
  SemanticMap(SemanticMap&&) = default;
  SemanticMap& operator=(SemanticMap&&) = default;

  // What there can be -------------------------------------------------------------------------------------------------

  tl::expected<NodeId, NetworkError> add_attribute(std::string_view name, Attribute attribute);
  tl::expected<NodeId, NetworkError> add_type(std::string_view name);
  /// Connects the two; `weight` counts in comparisons of two objects of the type, beside those of its other attributes.
  tl::expected<void, NetworkError> add_to_type(NodeId type, NodeId attribute, double weight = 1);
  /// Connects it with its types and attributes. A clause speaks of an attribute that its role's type has.
  tl::expected<NodeId, NetworkError> add_action(std::string_view name, Action action);

  const Attribute& attribute(NodeId node) const { return attributes_[record_[node]]; }
  const Action& action(NodeId node) const { return actions_[record_[node]]; }
  /// The largest that one of the types gives the attribute; 1 where none does.
  double weight(std::span<const NodeId> types, NodeId attribute) const;
  /// The type of that name, made if it is unknown.
  tl::expected<NodeId, NetworkError> type_named(std::string_view name);

  // What there is -----------------------------------------------------------------------------------------------------

  /// Without a name it gets TYPE_NUMBER, which no object had before. Not outside of the map.
  tl::expected<NodeId, NetworkError> add_object(NodeId type, double x_m, double y_m, std::string_view name = {});
  /// False: outside of the map; it stays where it was.
  bool move(NodeId object, double x_m, double y_m);
  void remove(NodeId object);
  Object& object(NodeId node) { return objects_[node]; }
  const Object& object(NodeId node) const { return objects_[node]; }

  Value state(NodeId object, NodeId attribute) const;
  /// Connects the attribute with the object itself if its types lack it. False: the value does not fit, or there is no
  /// room. An unknown value is forgotten.
  bool set_state(NodeId object, NodeId attribute, const Value& value);
  /// Whether all that the action requires of these objects, one a role, is true.
  bool possible(const Action& action, std::span<const NodeId> objects) const;
  /// Makes its results true.
  void apply(const Action& action, std::span<const NodeId> objects);

  // Where -------------------------------------------------------------------------------------------------------------

  navigation::OccupancyView grid() const { return view_; }
  bool contains(double x_m, double y_m) const { return view_.contains(view_.cell_of(x_m, y_m)); }
  /// Takes over the known cells of another grid of any cell size; -1 there changes nothing here.
  void take_over(const navigation::OccupancyView& other);
  Terrain terrain(double x_m, double y_m) const;
  /// Kept at the place until another is seen there. Nothing outside of the map.
  void set_terrain(double x_m, double y_m, Terrain terrain);

  /// visit(object) for each object in the cell.
  template <class Visit>
  void in_cell(const navigation::Cell& cell, Visit visit) const {
    for (NodeId o = first_[index(cell)]; o != kNoNode; o = objects_[o].next) visit(o);
  }
  /// visit(object, distance_m) for each object at most so far away, in the order of the cells.
  template <class Visit>
  void near(double x_m, double y_m, double radius_m, Visit visit) const {
    const navigation::Cell low = clamped(x_m - radius_m, y_m - radius_m),
                           high = clamped(x_m + radius_m, y_m + radius_m);
    for (int row = low.row; row <= high.row; ++row)
      for (int column = low.column; column <= high.column; ++column)
        in_cell({column, row}, [&](NodeId o) {
          const double distance = std::hypot(objects_[o].x_m - x_m, objects_[o].y_m - y_m);
          if (distance <= radius_m) visit(o, distance);
        });
  }

  const Network& network() const { return network_; }
  /// Network, objects, and of the grids the box in which something is known. Attributes and actions follow from setup.
  void remember(StateArchive& archive);
  /// Objects, attributes, types or actions, ascending.
  std::vector<NodeId> all(Kind kind) const;

 private:
  struct Type {
    std::vector<std::pair<NodeId, double>> weights;
    uint32_t last_number = 0;  ///< of an object's name
    void remember(StateArchive& archive) { TAKT_STATE(archive, weights, last_number); }
  };
  tl::expected<NodeId, NetworkError> add(Kind kind, std::string_view name, size_t record);
  tl::expected<NodeId, NetworkError> add_numbered(NodeId type);
  size_t index(const navigation::Cell& cell) const {
    return static_cast<size_t>(cell.row) * static_cast<size_t>(parameters_.columns) + static_cast<size_t>(cell.column);
  }
  navigation::Cell clamped(double x_m, double y_m) const;
  void link(NodeId object, uint32_t cell);
  void unlink(NodeId object);
  void remember_objects(StateArchive& archive);

  MapParameters parameters_;
  Network network_;
  std::vector<uint32_t> record_;  ///< by node: place in one of the next three
  std::vector<Attribute> attributes_;
  std::vector<Type> types_;
  std::vector<Action> actions_;
  std::vector<Object> objects_;  ///< by node
  std::vector<NodeId> first_;    ///< by cell
  std::vector<Terrain> terrain_;
  std::vector<int16_t> occupancy_;
  navigation::OccupancyView view_;
};

}  // namespace takt::semantic
