// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <functional>
#include <map>
#include <vector>

#include "graph/expect/condition_watch.hpp"
#include "rt/sched/plan.hpp"
#include "rt/shm/follower.hpp"

namespace takt::graph {

/// What is true in the simulated world. Instants of the run's clock; any thread.
struct WorldTruth {
  std::vector<std::string> objects;  ///< robots included; empty: there is no such world
  std::function<std::optional<std::string>(const std::string& object, const std::string& attribute, int64_t at_ns)>
      attribute = {};
  /// x and y in the map, m.
  std::function<std::optional<std::array<double, 2>>(const std::string& object, int64_t at_ns)> position = {};
};

/// What the conditions ask of a world that it does not have.
std::vector<Problem> unknown_objects(const ExpectSpec& expect, const WorldTruth& world);

/// The conditions of a graph during a run: follows the outputs that they name and looks at the world. One thread at a
/// time.
class ExpectationWatch {
 public:
  /// From one look at the world to the next.
  static constexpr int64_t kWorldPeriod_ns = 10'000'000;

  /// After the ports have their memory, sized for a follower. Plan and transport outlive this.
  ExpectationWatch(const ExpectSpec& expect, const Plan& plan, Transport& transport, WorldTruth world);

  /// Takes in what was said since the last look, and what is true now; both instants of one clock.
  void look(int64_t now_ns, int64_t epoch_ns);
  /// The former alone, once the run is over.
  void look_at_messages(int64_t epoch_ns);
  /// The run need not go on: all conditions hold and one had to come true, or one can not hold any more.
  bool decided(int64_t now_ns, int64_t epoch_ns) const;
  /// Of the conditions, in the order of the file.
  std::vector<Finding> findings() const;

 private:
  struct Heard {
    size_t condition;
    bool excepts;  ///< it is what the condition's `unless` names
    MessageField field;
  };
  struct Port {
    Follower follower;
    std::vector<Heard> heard;
  };
  void hear(size_t condition, const ConditionSpec& spec, bool excepts, const Plan& plan, Transport& transport);
  void look_at_world(int64_t now_ns, int64_t epoch_ns);
  std::optional<FieldValue> truth(const ConditionSpec& spec, int64_t now_ns) const;

  const WorldTruth world_;
  std::vector<ConditionWatch> conditions_;
  std::map<size_t, Port> ports_;  ///< by index into the plan's
  int64_t next_world_ns_ = 0;
  uint64_t gone_ = 0;  ///< messages that could not be followed
};

}  // namespace takt::graph
