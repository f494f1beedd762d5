// SPDX-License-Identifier: Apache-2.0
// Conditions on the messages of a port and on a world that the test holds in its hands.
#include "graph/expect/expectation_watch.hpp"

#include <doctest/doctest.h>

#include "rt/msg/odometry.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::graph;
using test::kMs;

namespace {

constexpr int64_t kEpoch = 1'000 * kMs;

struct Fixture {
  Plan plan;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Writer> writer;
  ExpectSpec expect;
  std::string content = "empty";
  std::array<double, 2> place{0, 0};

  Fixture() {
    plan.ports.push_back({"base", "odometry", &MessageType::of<Odometry>(), {}, 4, 1, 1});
    transport = make_local_transport(plan.ports);
    writer = transport->make_writer(0);
  }
  void say(double speed_m_s, int64_t at_ns) {
    MessageHeader* header = writer->loan();
    REQUIRE(header != nullptr);
    reinterpret_cast<Odometry*>(header + 1)->speed_m_s = speed_m_s;
    writer->publish(at_ns, at_ns, at_ns);
  }
  ConditionSpec& speed(double low, Holds holds) {
    ConditionSpec spec;
    spec.of = ConditionSpec::Of::field;
    spec.port = {"base", "odometry"};
    spec.field = "speed_m_s";
    spec.bound.at_least = low;
    spec.holds = holds;
    return expect.conditions.emplace_back(spec);
  }
  WorldTruth world() {
    WorldTruth truth;
    truth.objects = {"ace", "cup"};
    truth.attribute = [this](const std::string& object, const std::string& name, int64_t) {
      return object == "cup" && name == "content" ? std::optional(content) : std::nullopt;
    };
    truth.position = [this](const std::string& object, int64_t) {
      return object == "ace" ? std::optional(place) : std::optional(std::array{3.0, 4.0});
    };
    return truth;
  }
  ExpectationWatch watch() { return {expect, plan, *transport, world()}; }
};

}  // namespace

TEST_CASE("every message is judged, though several come between two looks") {
  Fixture f;
  f.speed(1, Holds::once);
  f.speed(0, Holds::always);
  f.expect.conditions.emplace_back().port = {"base", "odometry"};
  f.expect.conditions.back().bound.at_least = 4;
  auto watch = f.watch();
  watch.look(kEpoch, 0);  // the epoch is not known yet
  f.say(0, kEpoch);
  f.say(2, kEpoch + 10 * kMs);
  f.say(0, kEpoch + 20 * kMs);
  watch.look(kEpoch + 25 * kMs, kEpoch);
  CHECK_FALSE(watch.decided(kEpoch + 25 * kMs, kEpoch));
  f.say(0.5, kEpoch + 30 * kMs);
  watch.look(kEpoch + 35 * kMs, kEpoch);
  CHECK(watch.decided(kEpoch + 35 * kMs, kEpoch));
  const auto findings = watch.findings();
  REQUIRE(findings.size() == 3);
  CHECK(all_met(findings));
  CHECK(findings[0].since_s == doctest::Approx(0.01));
  CHECK(findings[2].observed == "4");
  f.say(-1, kEpoch + 40 * kMs);
  watch.look_at_messages(kEpoch);
  CHECK_FALSE(all_met(watch.findings()));
  CHECK(watch.decided(kEpoch + 45 * kMs, kEpoch));  // nothing can mend it
}

TEST_CASE("a run lasts to its end where nothing has to come true") {
  Fixture f;
  f.speed(0, Holds::always);
  auto watch = f.watch();
  f.say(1, kEpoch);
  watch.look(kEpoch + kMs, kEpoch);
  CHECK(all_met(watch.findings()));
  CHECK_FALSE(watch.decided(kEpoch + kMs, kEpoch));
}

TEST_CASE("messages that were gone before they could be read are told, and make no proof") {
  Fixture f;
  f.speed(0, Holds::always);
  auto watch = f.watch();
  for (int i = 0; i < 100; ++i) f.say(1, kEpoch + i * kMs);
  watch.look(kEpoch + 100 * kMs, kEpoch);
  REQUIRE(watch.findings().size() == 2);
  CHECK(watch.findings()[1].what == "messages followed");
  CHECK_FALSE(all_met(watch.findings()));
}

TEST_CASE("the world: attributes, distances from places and objects; it is looked at every 10 ms") {
  Fixture f;
  ConditionSpec full, near, nearer;
  full.of = ConditionSpec::Of::attribute;
  full.object = "cup", full.attribute = "content", full.is = "full";
  near.of = ConditionSpec::Of::distance;
  near.object = "ace", near.x_m = 3, near.y_m = 4, near.bound.at_most = 0.5, near.unit = "m";
  nearer = near;
  nearer.other = "cup", nearer.bound.at_most = 5.1, nearer.holds = Holds::always;
  f.expect.conditions = {full, near, nearer};
  auto watch = f.watch();
  watch.look(kEpoch, kEpoch);
  auto findings = watch.findings();
  CHECK(findings[0].observed == "\"empty\"");
  CHECK(findings[1].observed == "5 m");
  CHECK(findings[1].what == "ace from (3 m, 4 m)");
  CHECK(findings[1].expected == "at the end within 0.5 m");
  CHECK(findings[2].what == "ace from cup");
  CHECK(findings[2].met);
  f.content = "full";
  f.place = {3.2, 4.3};
  watch.look(kEpoch + 9 * kMs, kEpoch);
  CHECK_FALSE(watch.decided(kEpoch + 9 * kMs, kEpoch));
  watch.look(kEpoch + 10 * kMs, kEpoch);
  CHECK(watch.decided(kEpoch + 10 * kMs, kEpoch));
  CHECK(watch.findings()[1].since_s == doctest::Approx(0.01));
}

TEST_CASE("what is true while the exception's newest message passes does not count") {
  Fixture f;
  ConditionSpec never;
  never.of = ConditionSpec::Of::attribute;
  never.object = "cup", never.attribute = "content", never.is = "full", never.holds = Holds::never;
  never.unless.push_back(f.speed(1, Holds::at_end));
  f.expect.conditions = {never};
  auto watch = f.watch();
  watch.look(kEpoch, kEpoch);
  CHECK(watch.findings()[0].met);
  CHECK(watch.findings()[0].expected == "never is \"full\" unless base.odometry speed_m_s at least 1");
  f.content = "full";
  f.say(2, kEpoch + 5 * kMs);
  watch.look(kEpoch + 10 * kMs, kEpoch);
  CHECK(watch.findings()[0].met);
  f.say(0, kEpoch + 15 * kMs);
  watch.look(kEpoch + 20 * kMs, kEpoch);
  CHECK_FALSE(watch.findings()[0].met);
  CHECK(watch.findings()[0].since_s == doctest::Approx(0.02));
  CHECK(watch.decided(kEpoch + 20 * kMs, kEpoch));

  Fixture silent;  // nobody says anything that passes: all of it counts
  silent.expect.conditions = {never};
  silent.content = "full";
  auto strict = silent.watch();
  strict.look(kEpoch, kEpoch);
  CHECK_FALSE(strict.findings()[0].met);
}

TEST_CASE("objects that the world does not have are told before the run, with those it has") {
  Fixture f;
  ConditionSpec spec;
  spec.of = ConditionSpec::Of::distance;
  spec.object = "ace", spec.other = "cupp";
  spec.position = {"graph.yaml", 7, 5};
  f.expect.conditions = {spec};
  const auto problems = unknown_objects(f.expect, f.world());
  REQUIRE(problems.size() == 1);
  CHECK(to_string(problems[0]).starts_with("graph.yaml:7:5: error: the simulated world has no object `cupp`"));
  CHECK(problems[0].text.find("did you mean `cup`?") != std::string::npos);
  f.expect.conditions[0].other = "cup";
  CHECK(unknown_objects(f.expect, f.world()).empty());
}
