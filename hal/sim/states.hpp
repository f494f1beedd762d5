// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/sim/track.hpp"
#include "hal/sim/world.hpp"

namespace takt::sim {

/// Number of an object's attribute, or of the place of an object.
using Variable = uint32_t;
/// Number of what a variable can be: of a text of the world, or of a place that an object can have.
using ValueId = int32_t;
constexpr ValueId kUnknown = -1;

/// Where an object can be.
struct Whereabouts {
  enum class Kind : uint8_t {
    at,       ///< position and yaw
    on,       ///< on top of object `index`
    carried,  ///< by the robot of client `index`
    away
  } kind = Kind::away;
  size_t index = 0;
  Vec2 position = Vec2::Zero();
  double yaw_rad = 0;
};

/// The state of a world's objects over time: what the world began with, what its events changed,
/// and what each robot's actions did. One writer per robot, lock-free readers. All that a variable can become is
/// numbered at the beginning, so that nothing allocates later. Instants count from the epoch of the run.
class States {
 public:
  /// The world must outlive this.
  explicit States(const World& world);

  std::optional<size_t> object(std::string_view name) const;
  /// Which variable holds an attribute of an object; nothing: it has none of that name and never gets one.
  std::optional<Variable> attribute(size_t object, std::string_view name) const;
  /// visit(name, variable) for each attribute of an object.
  template <class Visit>
  void each_attribute(size_t object, Visit&& visit) const {
    for (size_t i = 0; i < attributes_.size(); ++i)
      if (attributes_[i].object == object) visit(attributes_[i].name, static_cast<Variable>(world_.objects.size() + i));
  }
  Variable place(size_t object) const { return static_cast<Variable>(object); }

  /// Of a text that is in the world; kUnknown: no variable can ever have it.
  ValueId value(std::string_view text) const;
  std::string_view text(ValueId value) const { return texts_[static_cast<size_t>(value)]; }
  ValueId on(size_t object) const { return static_cast<ValueId>(world_.objects.size() + object); }
  ValueId carried(size_t robot) const { return static_cast<ValueId>(2 * world_.objects.size() + robot); }
  ValueId away() const { return static_cast<ValueId>(2 * world_.objects.size() + world_.clients.size()); }

  /// What the variable is then. Of changes at one instant that of the last robot counts, events come before them.
  ValueId at(Variable variable, int64_t since_epoch_ns) const;
  const Whereabouts& whereabouts(size_t object, int64_t since_epoch_ns) const {
    return places_[static_cast<size_t>(at(place(object), since_epoch_ns))];
  }
  /// Of the look that holds then, or the object's own.
  const Shape& shape(size_t object, int64_t since_epoch_ns) const;
  /// By that robot's writer only, in the order of the instants.
  void change(size_t robot, Variable variable, const Change& change);

  /// True if the object's look or place may ever change.
  bool changes(size_t object) const { return !looks_[object].empty() || moves_[object]; }

 private:
  struct AttributeVariable {
    size_t object;
    std::string name;
  };
  struct LookRule {
    std::vector<std::pair<Variable, ValueId>> when;
    const Shape* shape;
  };
  void add_attribute(size_t object, const std::string& name);
  ValueId add_text(const std::string& text);
  void add_objects();
  void add_actions();
  void add_events();

  const World& world_;
  std::vector<std::string> texts_;
  std::vector<Whereabouts> places_;  ///< at first of each object, on each, carried by each robot, away, by events
  std::vector<AttributeVariable> attributes_;  ///< variable - number of objects
  std::vector<ValueId> at_first_;              ///< by variable
  std::vector<std::vector<Change>> events_;    ///< by variable
  std::vector<std::vector<LookRule>> looks_;   ///< by object
  std::vector<bool> moves_;                    ///< by object
  std::unique_ptr<Track[]> tracks_;            ///< robot * variables + variable; null: the world has no actions
};

}  // namespace takt::sim
