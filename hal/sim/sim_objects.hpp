// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/actor/actor.hpp"
#include "hal/object_sensor/object_sensor.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"

namespace takt::sim {

/// A perception that knows the truth, as far as it is told to tell it.
struct PerceptionModel {
  double fov_rad = 1.1519, range_m = 5;  ///< R-13
  double sigma_m = 0;                    ///< of a place, along each level axis
  double miss = 0;                       ///< probability that an object in view is not reported
  double unknown = 0;                    ///< probability that an attribute in view is not
  double score = 1;                      ///< how sure of a type it says to be
  bool names = true;                     ///< tells what objects are called
  std::vector<std::string> types{};      ///< of the objects that it knows; empty: all
};

/// Objects of the simulated world in the robot's view. What is missed, and by how much a place is off, depends on seed,
/// object and stamp alone.
class SimObjectSensor final : public ObjectSensor {
 public:
  SimObjectSensor(std::string id, PerceptionModel model, Simulation& simulation)
      : id_(std::move(id)), model_(std::move(model)), simulation_(simulation) {}
  /// Refuses probabilities and scores outside of 0..1, and types that no object has.
  DeviceResult open() override;
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  uint32_t most_objects() const override { return static_cast<uint32_t>(sought_.size()); }
  ObjectReading read(ObjectReports& reports, int64_t wanted_ns, int64_t deadline_ns) override;

 private:
  void report(size_t object, const Placed& placed, int64_t at_ns, ObjectReports& reports) const;

  std::string id_;
  PerceptionModel model_;
  Simulation& simulation_;
  std::vector<size_t> sought_;  ///< objects of the types
  Snapshot in_the_way_;
  bool started_ = false;
};

/// Carries the actions of the simulated world out.
class SimActor final : public Actor {
 public:
  /// `spread`: an action takes longer or shorter than its cost by this share at most.
  SimActor(std::string id, Simulation& simulation, double spread = 0)
      : id_(std::move(id)), simulation_(simulation), spread_(spread) {}
  ~SimActor() override { stop(); }
  /// Refuses a world without actions, and a spread outside of 0..0.9.
  DeviceResult open() override;
  void close() override {}
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  bool command(const ActionCommand& command, int64_t at_ns) override;
  ActorReading read(int64_t wanted_ns, int64_t deadline_ns) override;

 private:
  std::string id_;
  Simulation& simulation_;
  double spread_;
  bool started_ = false;
};

}  // namespace takt::sim
