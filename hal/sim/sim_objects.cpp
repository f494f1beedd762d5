// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/sim_objects.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "hal/sim/random.hpp"

namespace takt::sim {
namespace {

constexpr uint64_t kMissDraw = 0x0B1, kPlaceDraw = 0x0B2, kAttributeDraw = 0x0B3;

template <size_t N>
void put(char (&field)[N], std::string_view text) {
  const size_t length = std::min(text.size(), N - 1);
  std::memcpy(field, text.data(), length);
  std::memset(field + length, 0, N - length);
}

}  // namespace

DeviceResult SimObjectSensor::open() {
  const auto share = [](double value) { return value >= 0 && value <= 1; };
  if (!share(model_.miss) || !share(model_.unknown) || !share(model_.score))
    return device_error(id_, "`miss`, `unknown` or `score` is not in 0..1", "give shares");
  if (!(model_.fov_rad > 0 && model_.fov_rad <= 6.2832 && model_.range_m > 0 && model_.sigma_m >= 0))
    return device_error(id_, "`fov`, `range` or `noise` is out of range",
                        "fov in (0, 360deg], range positive, noise not negative");
  const auto& objects = simulation_.world().objects;
  for (const std::string& type : model_.types) {
    if (std::any_of(objects.begin(), objects.end(), [&](const WorldObject& o) { return o.type == type; })) continue;
    std::string known;
    for (const WorldObject& o : objects)
      if ((", " + known + ", ").find(", " + o.type + ", ") == std::string::npos)
        known.append(known.empty() ? "" : ", ").append(o.type);
    return device_error(id_, "no object of the world is of type `" + type + "`", "known types: " + known);
  }
  sought_.clear();
  for (size_t i = 0; i < objects.size(); ++i) {
    if (model_.types.empty() ||
        std::find(model_.types.begin(), model_.types.end(), objects[i].type) != model_.types.end())
      sought_.push_back(i);
  }
  in_the_way_ = simulation_.make_snapshot();
  return {};
}

DeviceResult SimObjectSensor::start(int64_t epoch_ns) {
  simulation_.begin(epoch_ns);
  started_ = true;
  return {};
}

ObjectReading SimObjectSensor::read(ObjectReports& reports, int64_t wanted_ns, int64_t deadline_ns) {
  if (!started_ || wanted_ns > deadline_ns) return {};
  reports.in_map = 0;
  reports.names.resize(0);
  reports.places.resize(0);
  reports.attributes.resize(0);
  simulation_.look(wanted_ns, in_the_way_);
  const auto instant = static_cast<uint64_t>(wanted_ns - simulation_.epoch_ns());
  Placed placed;
  for (const size_t object : sought_) {
    if (!simulation_.sees(object, wanted_ns, model_.fov_rad, model_.range_m, in_the_way_, placed)) continue;
    if (uniform(mix(simulation_.seed() ^ kMissDraw, instant, object)) < model_.miss) continue;
    report(object, placed, wanted_ns, reports);
  }
  return {ReadStatus::ok, wanted_ns};
}

void SimObjectSensor::report(size_t object, const Placed& placed, int64_t at_ns, ObjectReports& reports) const {
  const WorldObject& known = simulation_.world().objects[object];
  const auto instant = static_cast<uint64_t>(at_ns - simulation_.epoch_ns());
  ObjectName name;
  if (model_.names) put(name.name, known.name);
  put(name.type, known.type);
  reports.names.push_back(name);

  const RobotState robot = simulation_.robot(at_ns);
  const double c = std::cos(robot.theta_rad), s = std::sin(robot.theta_rad);
  const double dx = placed.position.x() - robot.x_m, dy = placed.position.y() - robot.y_m;
  const auto noise = [&](uint64_t axis) {
    return model_.sigma_m * normal(simulation_.seed() ^ kPlaceDraw, instant, 2 * object + axis);
  };
  const auto& box = placed.shape->box;
  const double middle = box                    ? box->z_m + placed.lift_m + box->height_m / 2
                        : placed.shape->person ? placed.shape->person->height_m / 2
                                               : placed.shape->board->z_m + placed.shape->board->edge_m / 2;
  ObjectPlace place{};
  place.x_m = static_cast<float>(s * dx - c * dy + noise(0));  // the robot's x axis points to its right
  place.y_m = static_cast<float>(c * dx + s * dy + noise(1));
  place.z_m = static_cast<float>(middle);
  place.yaw_rad =
      static_cast<float>(std::remainder(placed.yaw_rad - robot.theta_rad + std::numbers::pi / 2, 2 * std::numbers::pi));
  place.score = static_cast<float>(model_.score);

  const States& states = simulation_.stage().states();
  uint32_t attributes = 0;
  states.each_attribute(object, [&](const std::string& attribute, Variable variable) {
    const ValueId value = states.at(variable, at_ns - simulation_.epoch_ns());
    if (value == kUnknown || uniform(mix(simulation_.seed() ^ kAttributeDraw, instant, variable)) < model_.unknown)
      return;
    ObjectAttribute told;
    put(told.name, attribute);
    put(told.value, states.text(value));
    attributes += reports.attributes.push_back(told) ? 1 : 0;
  });
  place.attributes = static_cast<float>(attributes);
  reports.places.push_back(place);
}

DeviceResult SimActor::open() {
  if (simulation_.world().actions.empty())
    return device_error(id_, "the world `" + simulation_.world().name + "` has no actions", "add <action> elements");
  if (!(spread_ >= 0 && spread_ <= 0.9)) return device_error(id_, "`spread` is not in 0..0.9", "give a share");
  return {};
}

DeviceResult SimActor::start(int64_t epoch_ns) {
  simulation_.begin(epoch_ns);
  simulation_.actions().start(epoch_ns, spread_);
  started_ = true;
  return {};
}

void SimActor::stop() {
  if (started_) simulation_.actions().stop();
  started_ = false;
}

bool SimActor::command(const ActionCommand& command, int64_t at_ns) {
  return started_ && simulation_.actions().command(command, at_ns);
}

ActorReading SimActor::read(int64_t wanted_ns, int64_t deadline_ns) {
  if (!started_ || wanted_ns > deadline_ns) return {};
  simulation_.actions().advance(wanted_ns);
  return {ReadStatus::ok, wanted_ns, simulation_.actions().outcome(wanted_ns)};
}

}  // namespace takt::sim
