// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/stop_trials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include "graph/ace/ace_registry.hpp"
#include "graph/compose/composition.hpp"
#include "hal/laser/laser_node.hpp"
#include "hal/settings/settings.hpp"
#include "hal/sim/random.hpp"
#include "hal/sim/sim_devices.hpp"
#include "hal/sim/worlds.hpp"
#include "nodes/obstacle_stop/protected_field.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/sched/executor.hpp"
#include "rt/time/units.hpp"

namespace takt::command {
namespace {

using sim::RobotState;
using sim::Vec2;

// The robot, and what the node keeps free around it.
constexpr double kHalfWidth = obstacle_stop::kRobotWidth_m / 2, kHalfLength = obstacle_stop::kRobotLength_m / 2;
constexpr double kMargin = obstacle_stop::kMargin_m;
constexpr double kMoving_m_s = 0.05;
// A person of 1.75 m as hal/sim draws one: shins, where the laser looks; torso with arms, what the robot would touch.
constexpr double kLegAside = 0.10, kLegRadius = 0.055, kBodyAside = 0.15, kBodyRadius = 0.15;
constexpr double kDeceleration_m_s2 = 1, kReaction_s = 0.25;  // of stopping_distance()
constexpr int64_t kTick_ns = 10'000'000;
constexpr double kTick_s = 0.01;
constexpr double kLongest_s = 6;  ///< of a trial, once he has appeared

/// Map frame to robot frame and back: y forward, x right.
Vec2 in_robot(const RobotState& robot, const Vec2& p) {
  const double c = std::cos(robot.theta_rad), s = std::sin(robot.theta_rad);
  const Vec2 d = p - Vec2(robot.x_m, robot.y_m);
  return {s * d.x() - c * d.y(), c * d.x() + s * d.y()};
}
Vec2 in_map(const RobotState& robot, const Vec2& p) {
  const double c = std::cos(robot.theta_rad), s = std::sin(robot.theta_rad);
  return {robot.x_m + s * p.x() + c * p.y(), robot.y_m - c * p.x() + s * p.y()};
}

struct Stance {
  Vec2 at;
  double facing_rad = 0;  ///< from the map's x axis
  Vec2 left() const { return {-std::sin(facing_rad), std::cos(facing_rad)}; }
  std::array<Vec2, 2> legs() const { return {at + kLegAside * left(), at - kLegAside * left()}; }
};

/// Somebody on his way, which begins where the trial says, seen from the robot at that instant.
class Person {
 public:
  Person(const StopTrial& trial, const sim::Simulation& simulation) : trial_(trial), simulation_(simulation) {}
  /// Nothing before he appears; asked for no instant that the simulation has not settled yet before that.
  std::optional<Stance> at(int64_t at_ns) const {
    const double since = to_seconds(at_ns - simulation_.epoch_ns()) - trial_.appears_s;
    if (since < 0) return std::nullopt;
    if (!from_)
      from_ = simulation_.robot(simulation_.epoch_ns() + static_cast<int64_t>(std::llround(trial_.appears_s * 1e9)));
    const double way = trial_.pace_m_s * std::min(since, trial_.stops_after_s);
    const Vec2 direction(-std::sin(trial_.heading_rad), std::cos(trial_.heading_rad));
    return Stance{in_map(*from_, Vec2(trial_.x_m, trial_.y_m) + way * direction),
                  from_->theta_rad + trial_.heading_rad};
  }

 private:
  const StopTrial trial_;
  const sim::Simulation& simulation_;
  mutable std::optional<RobotState> from_;
};

/// Distance from `origin` along `direction` (unit) to a circle; infinity if it is missed.
double cast_circle(const Vec2& centre, double radius, const Vec2& origin, const Vec2& direction) {
  const Vec2 rel = origin - centre;
  const double b = rel.dot(direction), h = b * b - rel.squaredNorm() + radius * radius;
  const double t = -b - std::sqrt(std::max(h, 0.0));
  return h >= 0 && t > 0 ? t : std::numeric_limits<double>::infinity();
}

/// The simulated scanner with a person before it.
class LaserWithPerson final : public LaserScanner {
 public:
  LaserWithPerson(const sim::LaserModel& model, sim::Simulation& simulation, const Person& person)
      : model_(model), simulation_(simulation), person_(person), inner_("front_laser", model, simulation) {}
  DeviceResult open() override { return inner_.open(); }
  void close() override { inner_.close(); }
  DeviceResult start(int64_t epoch_ns) override { return inner_.start(epoch_ns); }
  void stop() override { inner_.stop(); }
  ScanFormat format() const override { return inner_.format(); }
  ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) override {
    const ScanReading reading = inner_.read(range_m, wanted_ns, deadline_ns);
    if (reading.status != ReadStatus::ok) return reading;
    const ScanFormat f = format();
    for (size_t i = 0; i < range_m.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(f.beams - 1);
      const int64_t at_ns = reading.stamp_ns + static_cast<int64_t>(share * f.sweep_s * 1e9);
      const auto stance = person_.at(at_ns);
      if (!stance) continue;
      const RobotState robot = simulation_.robot(at_ns);
      const Vec2 origin = in_map(robot, {f.sensor_in_robot.x, f.sensor_in_robot.y});
      const double angle = robot.theta_rad + f.first_angle_rad + static_cast<double>(i) * f.step_rad;
      double range = std::numeric_limits<double>::infinity();
      for (const Vec2& leg : stance->legs())
        range = std::min(range, cast_circle(leg, kLegRadius, origin, {std::cos(angle), std::sin(angle)}));
      if (range >= f.max_range_m || (range_m[i] > 0 && range >= static_cast<double>(range_m[i]))) continue;
      const double noise = model_.sigma_m * sim::normal(simulation_.seed(), static_cast<uint64_t>(at_ns), i);
      range_m[i] = static_cast<float>(std::max(range + noise, 0.001));
    }
    return reading;
  }

 private:
  const sim::LaserModel model_;
  sim::Simulation& simulation_;
  const Person& person_;
  sim::SimLaser inner_;
};

/// Between the robot's outline and the person's; 0 or less: they touch.
double gap_m(const RobotState& robot, const Stance& person) {
  constexpr int kSteps = 12;  // so near that circles about the points between make the body's outline to a millimetre
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kSteps; ++i) {
    const Vec2 p = in_robot(robot, person.at + kBodyAside * (2.0 * i / kSteps - 1) * person.left());
    least = std::min(
        least, std::hypot(std::max(std::abs(p.x()) - kHalfWidth, 0.0), std::max(std::abs(p.y()) - kHalfLength, 0.0)));
  }
  return least - kBodyRadius;
}

/// The robot in a map frame that is its own.
const RobotState kAtOrigin{.x_m = 0, .y_m = 0, .theta_rad = std::numbers::pi / 2};

/// From the scanner to the nearest point of his legs.
double legs_range_m(const Vec2& scanner, const Stance& person) {
  const auto legs = person.legs();
  return std::min((legs[0] - scanner).norm(), (legs[1] - scanner).norm()) - kLegRadius;
}

/// Follows one trial with the truth of the simulation.
class Referee {
 public:
  Referee(const sim::Simulation& simulation, const Person& person, const Transform& scanner)
      : simulation_(simulation), person_(person), scanner_(scanner.x, scanner.y) {}

  void look(int64_t now_ns) {
    for (; !over_ && next_ns() <= now_ns; ++tick_) judge(next_ns());
  }
  bool over() const { return over_; }
  StopOutcome outcome() const { return outcome_; }

 private:
  int64_t next_ns() const { return simulation_.epoch_ns() + tick_ * kTick_ns; }

  void judge(int64_t at_ns) {
    const auto stance = person_.at(at_ns);
    if (!stance) return;
    if (since_ns_ == 0) since_ns_ = at_ns, outcome_.least_gap_m = std::numeric_limits<double>::infinity();
    const RobotState robot = simulation_.robot(at_ns);
    const double speed = std::abs(robot.speed_m_s);
    if (speed > kMoving_m_s) {
      if (!seen_) look_for(robot, *stance, at_ns);
      outcome_.least_gap_m = std::min(outcome_.least_gap_m, gap_m(robot, *stance));
      outcome_.contact = outcome_.least_gap_m <= 0;
      if (outcome_.contact) outcome_.impact_m_s = speed;
    }
    stood_ = speed > kMoving_m_s ? 0 : stood_ + 1;
    constexpr int kStands = 30;  // ticks
    over_ = outcome_.contact || stood_ >= kStands || to_seconds(at_ns - since_ns_) > kLongest_s;
  }

  /// Whether the laser can see a part of him in the robot's lane now, and how near he is then and later.
  void look_for(const RobotState& robot, const Stance& stance, int64_t at_ns) {
    using namespace obstacle_stop;
    constexpr double kLane_m = 6, kMostTurn = 3;
    const double time = std::min(kLane_m / std::abs(robot.speed_m_s),
                                 std::abs(robot.turn_rad_s) > 0 ? kMostTurn / std::abs(robot.turn_rad_s) : 1e3);
    const ProtectedField lane({kHalfWidth, kHalfLength, kHalfLength, kMargin}, {robot.speed_m_s, robot.turn_rad_s},
                              time);
    double range = std::numeric_limits<double>::infinity();
    for (const Vec2& leg : stance.legs()) {
      const Vec2 centre = in_robot(robot, leg);
      constexpr int kPoints = 48;
      for (int i = 0; i < kPoints; ++i) {
        const double angle = 2 * std::numbers::pi * i / kPoints;
        const Vec2 normal(std::cos(angle), std::sin(angle)), p = centre + kLegRadius * normal;
        const bool seen = p.y() >= scanner_.y() && normal.dot(scanner_ - p) > 0;
        if (seen && lane.contains(p.x(), p.y())) range = std::min(range, (p - scanner_).norm());
      }
    }
    if (!std::isfinite(range)) return;
    seen_ = true;
    outcome_.unavoidable = touched_though_braking(robot, at_ns);
    const double needed = stopping_distance(std::abs(robot.speed_m_s));
    const Vec2 scanner = in_map(robot, scanner_);
    const double now = legs_range_m(scanner, stance);
    double nearest = now;
    for (double later = 0; later < kLongest_s; later += kTick_s)
      nearest = std::min(nearest,
                         legs_range_m(scanner, *person_.at(at_ns + static_cast<int64_t>(std::llround(later * 1e9)))));
    constexpr double kComes_m = 0.01;
    outcome_.distance = range < needed                               ? Distance::near
                        : nearest < std::min(needed, now - kComes_m) ? Distance::comes_nearer
                                                                     : Distance::far;
  }

  /// Whether he and a robot that brakes from now on, with the figures of stopping_distance(), touch while it moves.
  bool touched_though_braking(RobotState robot, int64_t at_ns) const {
    const double speed = robot.speed_m_s, turn = robot.turn_rad_s;
    for (int tick = 0; std::abs(robot.speed_m_s) > kMoving_m_s; ++tick) {
      if (gap_m(robot, *person_.at(at_ns + tick * kTick_ns)) <= 0) return true;
      const double braking = std::max(0.0, tick * kTick_s - kReaction_s) * kDeceleration_m_s2;
      const double share = std::max(0.0, 1 - braking / std::abs(speed));
      robot = {robot.x_m + robot.speed_m_s * kTick_s * std::cos(robot.theta_rad),
               robot.y_m + robot.speed_m_s * kTick_s * std::sin(robot.theta_rad),
               robot.theta_rad + robot.turn_rad_s * kTick_s, share * speed, share * turn};
    }
    return false;
  }

  const sim::Simulation& simulation_;
  const Person& person_;
  const Vec2 scanner_;
  StopOutcome outcome_;
  int64_t tick_ = 0, since_ns_ = 0;
  int stood_ = 0;
  bool seen_ = false, over_ = false;
};

/// The point so far along the robot's way, and so far to the right of it.
Vec2 beside_lane(double speed_m_s, double turn_rad_s, double along_m, double right_m) {
  const double angle = turn_rad_s * along_m / speed_m_s;
  if (std::abs(angle) < 1e-9) return {right_m, along_m};
  const double radius = speed_m_s / turn_rad_s;  // the centre is (-radius, 0)
  return {(radius + right_m) * std::cos(angle) - radius, (radius + right_m) * std::sin(angle)};
}

bool is_vision(const graph::GraphSpec& graph, const std::string& node) {
  return std::any_of(graph.nodes.begin(), graph.nodes.end(),
                     [&](const graph::NodeSpec& n) { return n.id == node && n.subsystem == "vision"; });
}

}  // namespace

std::string_view to_string(Walk walk) {
  constexpr std::array<std::string_view, kWalks> kNames{"stands", "steps in", "crosses", "walks up"};
  return kNames[static_cast<size_t>(walk)];
}

std::string_view to_string(Vision vision) {
  constexpr std::array<std::string_view, kVisions> kNames{"absent", "overloaded", "hanging"};
  return kNames[static_cast<size_t>(vision)];
}

std::string_view to_string(Distance distance) {
  constexpr std::array<std::string_view, kDistances> kNames{"far", "near", "comes nearer", "aside"};
  return kNames[static_cast<size_t>(distance)];
}

double stopping_distance(double speed_m_s) {
  return speed_m_s * speed_m_s / (2 * kDeceleration_m_s2) + kReaction_s * speed_m_s + 0.3;
}

StopTrial draw_trial(uint64_t seed, uint64_t number) {
  std::mt19937_64 engine(sim::mix(seed, number));
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); };
  StopTrial t;
  t.speed_m_s = draw(0.2, 1.4);
  if (number % 2 == 1) t.turn_rad_s = (draw(0, 1) < 0.5 ? -1 : 1) * draw(0.05, 0.5);
  t.walk = static_cast<Walk>(number / 2 % kWalks);
  t.appears_s = draw(2.5, 3.5);  // when the robot has its speed
  const double range = stopping_distance(t.speed_m_s) * draw(0.4, 2.0), lane = kHalfWidth + kMargin;
  const auto beside = [&](double along, double right) { return beside_lane(t.speed_m_s, t.turn_rad_s, along, right); };
  constexpr double kScanner_m = 0.30;
  if (t.walk == Walk::stands) {
    do {  // nobody appears within the robot
      const Vec2 place = beside(kScanner_m + range, draw(-1.4, 1.4) * lane);
      t.x_m = place.x(), t.y_m = place.y();
      t.heading_rad = draw(-std::numbers::pi, std::numbers::pi);
    } while (gap_m(kAtOrigin, {{t.x_m, t.y_m}, kAtOrigin.theta_rad + t.heading_rad}) <= 0);
    return t;
  }
  t.pace_m_s = draw(0.3, 1.5);
  Vec2 from, to;
  if (t.walk == Walk::walks_up) {
    from = beside(kScanner_m + 2 * range, draw(-1, 1) * lane);
    to = {draw(-1, 1) * lane, 0};
  } else {
    const double side = draw(0, 1) < 0.5 ? -1 : 1, from_right = side * draw(0.7, 1.8);
    const double to_right = t.walk == Walk::steps_in ? draw(-1, 1) * lane : -from_right;
    // At the distance drawn when he is in the lane: the robot drives on meanwhile.
    const double along = kScanner_m + range + t.speed_m_s * std::abs(from_right - to_right) / t.pace_m_s;
    from = beside(along + draw(-0.5, 0.5), from_right);
    to = beside(along, to_right);
  }
  t.x_m = from.x(), t.y_m = from.y();
  t.heading_rad = std::atan2(-(to - from).x(), (to - from).y());
  t.stops_after_s = t.walk == Walk::steps_in ? (to - from).norm() / t.pace_m_s : std::numeric_limits<double>::max();
  return t;
}

StopTrials::StopTrials(graph::GraphSpec yard, Vision vision, uint64_t seed)
    : yard_(std::move(yard)),
      vision_(vision),
      seed_(seed),
      registry_(ace_registry()),
      textures_(sim::textures_of(seed)) {
  // In virtual time it is said below what a job takes: it need not be spent.
  for (graph::NodeSpec& node : yard_.nodes)
    if (node.type == "load") node.params["work"] = {0.0, node.position};
}

StopOutcome StopTrials::run(const StopTrial& trial) {
  for (graph::NodeSpec& node : yard_.nodes) {
    if (node.id != "cruise") continue;
    node.params["speed"] = {trial.speed_m_s, node.position};
    node.params["turn"] = {trial.turn_rad_s, node.position};
  }
  VirtualClock clock(1'000'000'000);
  hal::Devices devices;
  std::optional<Person> person;
  Transform scanner;
  const graph::DeviceFactory factory =
      [&](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    const hal::DeviceConfig config{spec.id, spec.kind, spec.driver, spec.settings, yard_.directory, seed_};
    const auto failed = [&](const DeviceError& error) {
      return tl::make_unexpected(graph::ComposeError{{{spec.position, error.text()}}, !error.bad_input});
    };
    const auto world = sim::world_of(config, devices);
    if (!world) return failed(world.error());
    if (!person) person.emplace(trial, **world);
    if (spec.kind != "laser_scanner") {
      auto node = hal::make_device(registry_.devices, config, devices, clock);
      if (!node) return failed(node.error());
      return std::move(*node);
    }
    Settings settings(spec.id, spec.settings, yard_.directory);
    sim::LaserModel model;
    scanner = model.sensor_in_robot = settings.mount("mount");
    return std::make_unique<LaserNode>(std::make_unique<LaserWithPerson>(model, **world, *person));
  };
  auto composition = graph::compose(yard_, registry_, factory, clock, {std::filesystem::path(), seed_});
  if (!composition) throw std::runtime_error(graph::to_string(composition.error().problems.front()));
  const Plan& plan = composition->plan;
  const auto transport = make_local_transport(plan.ports);
  RunBoard board(plan);
  Referee referee(*sim::first_world(devices), *person, scanner);
  Executor::Options options;
  options.duration_ns = static_cast<int64_t>((trial.appears_s + kLongest_s + 1) * 1e9);
  options.board = &board;
  options.after_step = [&] {
    referee.look(clock.now_ns());
    if (referee.over()) board.stop().raise(clock.now_ns());
  };
  options.job_duration_ns = [&](size_t task, uint64_t job) -> int64_t {
    const TaskPlan& t = plan.tasks[task];
    if (!is_vision(yard_, t.name)) return t.budget_ns;
    constexpr uint64_t kHangs = 10;  // that job, and longer than any trial
    if (vision_ == Vision::hanging) return job < kHangs ? t.budget_ns : 60'000'000'000;
    return static_cast<int64_t>(static_cast<double>(t.budget_ns) * (1 + 5 * sim::uniform(sim::mix(seed_, task, job))));
  };
  Executor(plan, *transport, clock, options).run();
  for (auto& node : composition->nodes) node->finish();
  StopOutcome outcome = referee.outcome();
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    (is_vision(yard_, plan.tasks[t].name) ? outcome.vision_misses : outcome.chain_misses) +=
        board.task(t).deadline_misses.load();
  return outcome;
}

}  // namespace takt::command
