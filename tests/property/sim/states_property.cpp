// SPDX-License-Identifier: Apache-2.0
// The states that robots settle job by job against a replay of everything that was ordered and everything that
// happened, and robots that drive at random among each other.
#include <doctest/doctest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <tuple>

#include "rt/msg/ace/action.hpp"
#include "tests/property_scale.hpp"
#include "tests/unit/sim/acting_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::kMs;
using test::kSecond;

namespace {

constexpr size_t kObjects = 5, kRobots = 3;
constexpr int64_t kEpoch = 1'234'567'890'123, kLength = 12 * kSecond;
const char* const kValues[] = {"a", "b", "c"};

class Chance {
 public:
  explicit Chance(uint64_t seed) : engine_(seed) {}
  size_t below(size_t count) { return std::uniform_int_distribution<size_t>(0, count - 1)(engine_); }
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  int64_t ms(int64_t low, int64_t high) { return kMs * std::uniform_int_distribution<int64_t>(low, high)(engine_); }
  std::string value() { return kValues[below(3)]; }

 private:
  std::mt19937_64 engine_;
};

/// All within two metres, of two types, with few values: so that robots get into each other's way.
World random_world(Chance& chance) {
  World world;
  world.map.cell_m = 0.5;
  world.map.width = world.map.height = 20;
  world.map.occupied.assign(400, 0);
  for (size_t i = 0; i < kRobots; ++i) {
    Client client{"robot_" + std::to_string(i), 5 + chance.in(-0.6, 0.6), 5 + chance.in(-0.6, 0.6), 0, {}};
    if (i == 1)  // one drives about, in and out of reach
      client.path = {{{4, 5}, {5, 6}, {6.5, 5}, {5, 4}}, 0.8, 1.0, 0.5, true};
    world.clients.push_back(client);
  }
  for (size_t i = 0; i < kObjects; ++i) {
    WorldObject object;
    object.name = "object_" + std::to_string(i);
    object.type = i % 2 == 0 ? "even" : "odd";
    object.position = {5 + chance.in(-0.7, 0.7), 5 + chance.in(-0.7, 0.7)};
    object.yaw_rad = chance.in(-3, 3);
    object.attributes = {{"p", chance.value()}, {"q", chance.value()}};
    object.box = Box{chance.in(0.05, 0.3), chance.in(0.05, 0.3), 0.3, 0.5, Material::wood};
    world.objects.push_back(object);
  }
  for (size_t i = 0; i < 6; ++i) {
    WorldAction action;
    action.name = "action_" + std::to_string(i);
    action.cost_s = static_cast<double>(chance.ms(0, 1500)) * 1e-9;
    action.roles = {{"first", "even"}, {"second", i < 3 ? "odd" : "even"}};
    for (const char* role : {"first", "second"}) {
      if (chance.below(3) == 0) action.pre.push_back({role, chance.below(2) == 0 ? "p" : "q", chance.value()});
      action.post.push_back({role, chance.below(2) == 0 ? "p" : "q", chance.value()});
    }
    const std::string to[] = {"robot", "second", "away"};
    if (i % 2 == 0) action.moves.push_back({"first", to[chance.below(20) == 0 ? 2 : chance.below(2)]});
    world.actions.push_back(action);
  }
  for (int64_t t = chance.ms(0, 2000); t < kLength; t += chance.ms(50, 2000)) {
    WorldEvent event;
    event.at_s = static_cast<double>(t) * 1e-9;
    event.object = world.objects[chance.below(kObjects)].name;
    if (chance.below(3) == 0) event.position = {5 + chance.in(-0.7, 0.7), 5 + chance.in(-0.7, 0.7)};
    else event.attribute = chance.below(2) == 0 ? "p" : "q", event.value = chance.value();
    world.events.push_back(event);
  }
  return world;
}

struct Order {
  int64_t at_ns;
  size_t robot;
  ActionCommand command;
};

/// Commands to robots, each at one of its releases.
std::vector<Order> random_orders(const World& world, const std::vector<std::vector<int64_t>>& releases,
                                 Chance& chance) {
  std::vector<Order> orders;
  for (size_t robot = 0; robot < kRobots; ++robot) {
    uint32_t number = 0;
    for (const int64_t release : releases[robot]) {
      if (chance.below(14) != 0) continue;
      const WorldAction& action = world.actions[chance.below(world.actions.size())];
      std::string names[2];
      for (size_t i = 0; i < 2; ++i) {
        do names[i] = world.objects[chance.below(kObjects)].name;
        while (world.objects[static_cast<size_t>(names[i].back() - '0')].type != action.roles[i].type);
      }
      orders.push_back(
          {release, robot, test::action_command(++number, action.name.c_str(), names[0].c_str(), names[1].c_str())});
    }
  }
  return orders;
}

/// The world as one list of what happens, gone through from the beginning; all by name.
class Replay {
 public:
  Replay(const World& world, const Stage& robots, const std::vector<Order>& orders) : world_(world), robots_(robots) {
    for (const WorldObject& object : world.objects) {
      for (const auto& [name, value] : object.attributes) attributes_[object.name + "." + name] = value;
      places_[object.name] = {"", object.position, object.yaw_rad};
    }
    for (const WorldEvent& event : world.events)
      add(std::llround(event.at_s * 1e9), 0, 0, [this, event](int64_t) { happen(event); });
    for (size_t i = 0; i < orders.size(); ++i) add_order(orders, i);
    std::stable_sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) {
      return std::tie(a.at_ns, a.after_events, a.robot) < std::tie(b.at_ns, b.after_events, b.robot);
    });
  }
  /// Everything up to and at that instant.
  void run_to(int64_t at_ns) {
    for (; next_ < steps_.size() && steps_[next_].at_ns <= at_ns; ++next_) steps_[next_].happens(steps_[next_].at_ns);
  }
  std::optional<Vec2> position(const std::string& object, int64_t at_ns) const {
    const Where& where = places_.at(object);
    if (where.on == "away") return std::nullopt;
    if (where.on.empty()) return where.position;
    if (where.on[0] != '@') return position(where.on, at_ns);
    return robot_at(static_cast<size_t>(where.on[1] - '0'), at_ns);
  }
  const std::string& attribute(const std::string& name) const { return attributes_.at(name); }
  const std::map<std::pair<size_t, uint32_t>, uint8_t>& verdicts() const { return verdicts_; }
  bool doubtful() const { return doubtful_; }

 private:
  struct Where {
    std::string on;  ///< another object, "@0" of a robot, "away"; empty: position
    Vec2 position = Vec2::Zero();
    double yaw_rad = 0;
  };
  struct Step {
    int64_t at_ns;
    int after_events;
    size_t robot;
    std::function<void(int64_t)> happens;
  };
  void add(int64_t at_ns, int after_events, size_t robot, std::function<void(int64_t)> happens) {
    steps_.push_back({at_ns, after_events, robot, std::move(happens)});
  }
  void add_order(const std::vector<Order>& orders, size_t i) {
    const Order& order = orders[i];
    const WorldAction& action = world_.actions[static_cast<size_t>(order.command.action[7] - '0')];
    const int64_t begin = order.at_ns - kEpoch + kLatencyNs, end = begin + std::llround(action.cost_s * 1e9);
    const bool last = i + 1 == orders.size() || orders[i + 1].robot != order.robot;
    const int64_t given_up = last ? INT64_MAX : orders[i + 1].at_ns - kEpoch + kLatencyNs;
    if (std::string_view(order.command.objects[0]) == order.command.objects[1]) {
      verdicts_[{order.robot, order.command.number}] = action_state::refused;  // one object in two roles
      return;
    }
    auto begun = std::make_shared<bool>(false);
    add(begin, 1, order.robot, [this, order, action, begun](int64_t at_ns) {
      *begun = possible(order, action, at_ns);
      if (!*begun) verdicts_[{order.robot, order.command.number}] = action_state::refused;
    });
    if (end > given_up) return;
    add(end, 1, order.robot, [this, order, action, begun](int64_t at_ns) {
      if (!*begun) return;
      const bool done = possible(order, action, at_ns);
      verdicts_[{order.robot, order.command.number}] = done ? action_state::done : action_state::failed;
      if (done) apply(order, action);
    });
  }
  void happen(const WorldEvent& event) {
    if (event.attribute.empty()) places_[event.object] = {"", event.position, event.yaw_rad};
    else attributes_[event.object + "." + event.attribute] = event.value;
  }
  static std::string object_of(const Order& order, const std::string& role) {
    return order.command.objects[role == "first" ? 0 : 1];
  }
  Vec2 robot_at(size_t robot, int64_t at_ns) const {
    const RobotState s = robots_.robot(robot).state(kEpoch + at_ns);
    return {s.x_m, s.y_m};
  }
  /// The nearest of many points of the box.
  double distance(const std::string& object, size_t robot, int64_t at_ns) {
    const Vec2 from = robot_at(robot, at_ns), middle = *position(object, at_ns);
    std::string base = object;
    while (!places_.at(base).on.empty() && places_.at(base).on[0] != '@') base = places_.at(base).on;
    if (!places_.at(object).on.empty() && places_.at(object).on[0] == '@') return (from - middle).norm();
    // On something that is carried: its own box, as its carrier's place is turned.
    const double turn =
        places_.at(base).on.empty()
            ? places_.at(base).yaw_rad
            : robots_.robot(static_cast<size_t>(places_.at(base).on[1] - '0')).state(kEpoch + at_ns).theta_rad;
    const Box& box = *world_.objects[static_cast<size_t>(object.back() - '0')].box;
    double nearest = 1e9;
    for (int i = -25; i <= 25; ++i) {
      for (int k = -25; k <= 25; ++k) {
        const double x = box.width_m * i / 50, y = box.depth_m * k / 50;
        const Vec2 point =
            middle + Vec2(std::cos(turn) * x - std::sin(turn) * y, std::sin(turn) * x + std::cos(turn) * y);
        nearest = std::min(nearest, (point - from).norm());
      }
    }
    return nearest;
  }
  bool possible(const Order& order, const WorldAction& action, int64_t at_ns) {
    for (const ActionRole& role : action.roles) {
      if (!position(object_of(order, role.name), at_ns)) return false;
      const double far = distance(object_of(order, role.name), order.robot, at_ns);
      doubtful_ = doubtful_ || std::abs(far - kReach) < 1e-4;
      if (far > kReach) return false;
    }
    for (const RoleCondition& condition : action.pre)
      if (attributes_.at(object_of(order, condition.role) + "." + condition.attribute) != condition.value) return false;
    for (const RoleMove& move : action.moves) {
      if (move.to == "robot" || move.to == "away") continue;
      for (std::string below = object_of(order, move.to); places_.count(below) == 1; below = places_.at(below).on)
        if (below == object_of(order, move.role)) return false;
    }
    return true;
  }
  void apply(const Order& order, const WorldAction& action) {
    for (const RoleCondition& result : action.post)
      attributes_[object_of(order, result.role) + "." + result.attribute] = result.value;
    for (const RoleMove& move : action.moves)
      places_[object_of(order, move.role)].on = move.to == "robot"  ? "@" + std::to_string(order.robot)
                                                : move.to == "away" ? "away"
                                                                    : object_of(order, move.to);
  }

  const World& world_;
  const Stage& robots_;
  std::map<std::string, std::string> attributes_;  ///< by "object.attribute"
  std::map<std::string, Where> places_;
  std::vector<Step> steps_;
  size_t next_ = 0;
  std::map<std::pair<size_t, uint32_t>, uint8_t> verdicts_;
  bool doubtful_ = false;  ///< a decision was a matter of how fine that is
};

/// Releases of one robot's jobs: at most 70 ms apart.
std::vector<int64_t> random_releases(Chance& chance) {
  std::vector<int64_t> releases;
  const int64_t period = chance.ms(20, 70);
  for (int64_t at = kEpoch + chance.ms(0, 20); at < kEpoch + kLength + kSecond; at += period) releases.push_back(at);
  return releases;
}

}  // namespace

TEST_CASE("states settled job by job are those of a replay of all commands and events") {
  size_t compared = 0, settled_early = 0;
  std::map<uint8_t, int> verdicts;
  for (uint64_t seed = 0; seed < test::rounds(120u); ++seed) {
    CAPTURE(seed);
    Chance chance(test::seed(seed));
    const World world = random_world(chance);
    const auto stage = std::make_shared<Stage>(world, 1);
    std::deque<Simulation> robots;
    std::vector<std::vector<int64_t>> releases;
    for (size_t i = 0; i < kRobots; ++i) {
      robots.emplace_back(stage, i);
      robots.back().begin(kEpoch);
      robots.back().actions().start(kEpoch);
      releases.push_back(random_releases(chance));
    }
    const std::vector<Order> orders = random_orders(world, releases, chance);
    // Jobs in the order of their releases, those of one instant in any order.
    std::vector<std::tuple<int64_t, size_t, size_t>> jobs;
    for (size_t i = 0; i < kRobots; ++i)
      for (const int64_t at : releases[i]) jobs.emplace_back(at, chance.below(100), i);
    std::sort(jobs.begin(), jobs.end());
    // What was said to be settled when it still lay ahead must be true in the end.
    struct Claim {
      int64_t at_ns;
      size_t object;
      std::string p;
      std::optional<Vec2> position;
    };
    std::vector<Claim> claims;
    std::map<std::pair<size_t, uint32_t>, uint8_t> told;
    for (const auto& [at, order_of_jobs, i] : jobs) {
      for (const Order& order : orders)
        if (order.robot == i && order.at_ns == at) CHECK(robots[i].actions().command(order.command, at));
      robots[i].actions().advance(at);
      const ActionOutcome outcome = robots[i].actions().outcome(at);
      if (outcome.state > action_state::under_way) told[{i, outcome.number}] = outcome.state;
      const int64_t ahead = at + chance.ms(0, 100);
      if (!stage->settled(ahead)) continue;
      settled_early += ahead > at ? 1 : 0;
      const size_t object = chance.below(kObjects);
      const std::string& name = world.objects[object].name;
      claims.push_back({ahead, object, *robots[0].attribute(name, "p", ahead), robots[0].position(name, ahead)});
    }
    std::sort(claims.begin(), claims.end(), [](const Claim& a, const Claim& b) { return a.at_ns < b.at_ns; });
    Replay replay(world, *stage, orders);
    auto claim = claims.begin();
    for (int64_t t = 0; t < kLength; t += 5 * kMs) {
      for (; claim != claims.end() && claim->at_ns - kEpoch <= t; ++claim) {
        replay.run_to(claim->at_ns - kEpoch);
        if (replay.doubtful()) break;
        const std::string& name = world.objects[claim->object].name;
        CHECK(claim->p == replay.attribute(name + ".p"));
        CHECK(claim->position == replay.position(name, claim->at_ns - kEpoch));
      }
      replay.run_to(t);
      if (replay.doubtful()) break;
      for (const WorldObject& object : world.objects) {
        for (const char* attribute : {"p", "q"})
          REQUIRE(robots[0].attribute(object.name, attribute, kEpoch + t) ==
                  replay.attribute(object.name + "." + attribute));
        REQUIRE(robots[0].position(object.name, kEpoch + t) == replay.position(object.name, t));
        ++compared;
      }
    }
    if (replay.doubtful()) continue;
    replay.run_to(INT64_MAX);
    for (const auto& [which, state] : told) {
      ++verdicts[state];
      REQUIRE(replay.verdicts().count(which) == 1);
      CHECK(replay.verdicts().at(which) == state);
    }
  }
  MESSAGE(compared, " states compared, ", settled_early, " settled ahead; ", verdicts[action_state::done], " done, ",
          verdicts[action_state::refused], " refused, ", verdicts[action_state::failed], " failed");
  CHECK(compared >= test::at_scale(500'000));
  CHECK(settled_early >= test::at_scale(10'000));
  CHECK(verdicts[action_state::done] >= test::at_scale(200));
  CHECK(verdicts[action_state::refused] >= test::at_scale(200));
  CHECK(verdicts[action_state::failed] >= test::at_scale(20));
}

TEST_CASE("robots that drive at random do not run into each other") {
  double nearest = 1e9;
  for (uint64_t seed = 0; seed < test::rounds(40u); ++seed) {
    Chance chance(test::seed(seed));
    World world;
    world.map = *parse_rows("########## #........# #........# #........# #........# ##########", 0.5);
    world.clients = {{"a", 1.2, 1.2, 0, {}}, {"b", 3.6, 1.2, 3, {}}, {"c", 2.4, 1.8, 1.5, {}}};
    const auto stage = std::make_shared<Stage>(world, 1);
    stage->begin(0);
    std::array<std::pair<double, double>, 3> wanted{};
    for (int64_t t = 0; t < 30 * kSecond; t += 66 * kMs) {
      for (size_t i = 0; i < 3; ++i) {
        if (chance.below(15) == 0) wanted[i] = {chance.in(-1.4, 1.4), chance.in(-1.2, 1.2)};
        stage->robot(i).command_base(wanted[i].first, wanted[i].second, t);
        stage->robot(i).advance_base(t);
        for (size_t k = 0; k < i; ++k) {
          const RobotState a = stage->robot(i).state(t), b = stage->robot(k).state(t);
          nearest = std::min(nearest, std::hypot(a.x_m - b.x_m, a.y_m - b.y_m));
        }
      }
    }
  }
  MESSAGE("nearest ", nearest, " m, both radii ", 2 * kFootprintRadius, " m");
  CHECK(nearest > 2 * kFootprintRadius - 0.02);
}
