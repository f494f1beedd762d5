// SPDX-License-Identifier: Apache-2.0
// The simulated object sensor and actor as devices.
#include <doctest/doctest.h>

#include <cmath>
#include <set>

#include "hal/sim/failing_devices.hpp"
#include "hal/sim/sim_objects.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/testing.hpp"
#include "tests/has.hpp"
#include "tests/unit/sim/acting_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::has;
using test::kMs;
using test::kSecond;

namespace {

constexpr const char* kEye = R"(<client name="eye" x="3.5m" y="3.25m" theta="180deg"/>)";

struct Sensor {
  explicit Sensor(PerceptionModel model, const std::string& more = "", size_t client = 2, uint64_t seed = 3)
      : simulation(test::acting_stage(kEye + more, seed), client), sensor("eye", std::move(model), simulation) {
    REQUIRE(sensor.open().has_value());
    REQUIRE(sensor.start(0).has_value());
    Capacity capacity;
    capacity.count = sensor.most_objects();
    reports = test::Box<ObjectReports>(capacity);
  }
  ObjectReports& at(int64_t at_ns) {
    REQUIRE(sensor.read(*reports, at_ns, INT64_MAX).status == ReadStatus::ok);
    return *reports;
  }
  const ObjectPlace* find(const std::string& name) {
    for (size_t i = 0; i < reports->names.size; ++i)
      if (name == reports->names[i].name) return &reports->places[i];
    return nullptr;
  }
  /// "level=empty ..." of the i-th object.
  std::string attributes(size_t index) {
    size_t first = 0;
    for (size_t i = 0; i < index; ++i) first += static_cast<size_t>(reports->places[i].attributes);
    std::string all;
    for (size_t i = 0; i < static_cast<size_t>(reports->places[index].attributes); ++i)
      all += std::string(reports->attributes[first + i].name) + "=" + reports->attributes[first + i].value + " ";
    return all;
  }
  std::set<std::string> names() {
    std::set<std::string> all;
    for (const ObjectName& name : reports->names.items()) all.insert(name.name);
    return all;
  }
  Simulation simulation;
  SimObjectSensor sensor;
  test::Box<ObjectReports> reports;
};

std::string error_of(PerceptionModel model) {
  Simulation s(test::acting_stage(), 0);
  const auto opened = SimObjectSensor("eye", std::move(model), s).open();
  return opened ? "" : opened.error().text();
}

}  // namespace

TEST_CASE("an object is reported with its name, place in the robot frame and attributes of the instant") {
  Sensor sensor({}, R"(<event at="2s" object="cup" attr="level" value="full"/>
      <event at="4s" object="cup" x="2.0m" y="2.75m" yaw="30deg"/>)");
  sensor.at(kSecond);
  CHECK(sensor.names() == std::set<std::string>{"cup", "bottle", "table"});
  CHECK(sensor.reports->in_map == 0);
  const ObjectPlace* cup = sensor.find("cup");
  REQUIRE(cup != nullptr);
  CHECK(std::abs(cup->x_m) < 1e-5f);
  CHECK(cup->y_m == doctest::Approx(1.55f));
  CHECK(cup->z_m == doctest::Approx(0.76f));
  CHECK(cup->yaw_rad == doctest::Approx(-1.5708f).epsilon(0.001));
  CHECK(cup->score == 1.0f);
  CHECK(std::string(sensor.reports->names[0].type) == "cup");
  CHECK(sensor.attributes(0) == "level=empty ");
  CHECK(sensor.attributes(1) == "closed=true level=full ");
  sensor.at(3 * kSecond);
  CHECK(sensor.attributes(0) == "level=full ");
  sensor.at(5 * kSecond);
  CHECK(sensor.find("cup")->x_m == doctest::Approx(-0.5f));  // the robot looks along -x: smaller y is to its left
  CHECK(sensor.find("cup")->y_m == doctest::Approx(1.5f));
  CHECK(sensor.find("cup")->yaw_rad == doctest::Approx(-1.0472f).epsilon(0.001));
}

TEST_CASE("only what is in view is reported: angle, range, and what stands in the way") {
  Sensor narrow({.fov_rad = 0.02});
  narrow.at(kSecond);
  CHECK(narrow.names() == std::set<std::string>{"cup", "table"});
  Sensor near({.range_m = 1.5});
  near.at(kSecond);
  CHECK(near.names() == std::set<std::string>{"bottle"});
  Sensor away({}, "", 0);
  away.at(kSecond);
  CHECK(away.names() == std::set<std::string>{"crate"});  // 30 degrees to the left, 4.6 m
  Sensor hidden({}, R"(<event at="0s" object="crate" x="5.5m" y="2.7m"/>
      <event at="2s" object="door" attr="closed" value="true"/>)",
                0);
  hidden.at(kSecond);
  CHECK(hidden.names() == std::set<std::string>{"crate"});
  hidden.at(3 * kSecond);
  CHECK(hidden.names() == std::set<std::string>{"door"});
}

TEST_CASE("what is missed, unknown and displaced is as often and as much as the model says") {
  Sensor sensor({.sigma_m = 0.3, .miss = 0.25, .unknown = 0.4, .score = 0.7, .names = false, .types = {"cup"}});
  CHECK(sensor.sensor.most_objects() == 1);
  constexpr int kReads = 2000;
  int seen = 0, attributes = 0;
  double sum = 0, squares = 0;
  for (int64_t k = 0; k < kReads; ++k) {
    const ObjectReports& reports = sensor.at(k * 50 * kMs);
    if (reports.places.size == 0) continue;
    ++seen;
    CHECK(reports.names[0].name[0] == '\0');
    CHECK(reports.places[0].score == doctest::Approx(0.7f));
    attributes += static_cast<int>(reports.attributes.size);
    for (const double off :
         {static_cast<double>(reports.places[0].x_m), static_cast<double>(reports.places[0].y_m) - 1.55})
      sum += off, squares += off * off;
  }
  MESSAGE("missed ", 1 - seen / double{kReads}, ", unknown ", 1 - attributes / double(seen), ", sigma ",
          std::sqrt(squares / (2 * seen)));
  CHECK(seen / double{kReads} == doctest::Approx(0.75).epsilon(0.05));
  CHECK(attributes / double(seen) == doctest::Approx(0.6).epsilon(0.05));
  CHECK(std::abs(sum / (2 * seen)) < 0.03);
  CHECK(std::sqrt(squares / (2 * seen)) == doctest::Approx(0.3).epsilon(0.05));
}

TEST_CASE("a reading depends on seed and stamp alone") {
  const PerceptionModel model{.sigma_m = 0.1, .miss = 0.3};
  Sensor one(model), other(model), foreign(model, "", 2, 4);
  const auto places = [](Sensor& sensor, int64_t at_ns) {
    sensor.at(at_ns);
    std::vector<float> all;
    for (const ObjectPlace& place : sensor.reports->places.items()) all.insert(all.end(), {place.x_m, place.y_m});
    return all;
  };
  std::vector<std::vector<float>> forwards, backwards, elsewhere;
  for (int64_t k = 0; k < 20; ++k) forwards.push_back(places(one, k * 66 * kMs));
  for (int64_t k = 20; k-- > 0;) backwards.insert(backwards.begin(), places(other, k * 66 * kMs));
  for (int64_t k = 0; k < 20; ++k) elsewhere.push_back(places(foreign, k * 66 * kMs));
  CHECK(forwards == backwards);
  CHECK(forwards != elsewhere);
}

TEST_CASE("wrong models and worlds are told") {
  CHECK(has(error_of({.miss = 1.5}), "0..1"));
  CHECK(has(error_of({.fov_rad = 7}), "(0, 360deg]"));
  CHECK(has(error_of({.types = {"cup", "jug"}}), "`jug`"));
  CHECK(has(error_of({.types = {"jug"}}), "known types: cup, bottle, table, crate, door"));
  World world;
  world.map = *parse_rows("### #.# ###", 1.0);
  world.clients.push_back({"ace", 1.5, 1.5, 0, {}});
  Simulation nothing(world, 0, 1);
  CHECK(has(SimActor("actor", nothing).open().error().text(), "has no actions"));
}

TEST_CASE("an object sensor and an actor fail as they are told; what the actor does goes on") {
  Simulation s(test::acting_stage(kEye), 0), eye(s.stage().world(), 2, 3);
  FailingActor actor(std::make_unique<SimActor>("actor", s), FailureSchedule(*parse_failures("silent 500ms..2s")));
  REQUIRE(actor.open().has_value());
  REQUIRE(actor.start(0).has_value());
  actor.command(test::action_command(1, "open", "bottle"), 0);
  for (int64_t t = 0; t <= 2 * kSecond; t += 50 * kMs) {
    const ActorReading reading = actor.read(t, INT64_MAX);
    CHECK(reading.status == (t >= 500 * kMs && t < 2 * kSecond ? ReadStatus::no_data : ReadStatus::ok));
    if (t == 2 * kSecond) CHECK(reading.outcome.state == action_state::done);
  }
  CHECK(s.attribute("bottle", "closed", 1100 * kMs) == "false");

  FailingObjectSensor sensor(std::make_unique<SimObjectSensor>("sensor", PerceptionModel{.sigma_m = 0.1}, eye),
                             FailureSchedule(*parse_failures("frozen 1s..2s, garbage 2s..3s")));
  REQUIRE(sensor.open().has_value());
  REQUIRE(sensor.start(0).has_value());
  Capacity capacity;
  capacity.count = sensor.most_objects();
  test::Box<ObjectReports> reports(capacity);
  const auto x = [&](int64_t at_ns, ReadStatus expected) {
    CHECK(sensor.read(*reports, at_ns, INT64_MAX).status == expected);
    REQUIRE(reports->places.size > 0);
    return reports->places[0].x_m;
  };
  CHECK(x(0, ReadStatus::ok) != x(500 * kMs, ReadStatus::ok));
  CHECK(x(1000 * kMs, ReadStatus::ok) == x(1500 * kMs, ReadStatus::ok));
  x(2500 * kMs, ReadStatus::partial);
  CHECK(reports->places.size < 3);
}
