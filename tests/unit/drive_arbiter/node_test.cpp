// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_drive_arbiter(NodeTypes& types);
}

using namespace takt;

namespace {

const NodeType& arbiter() {
  static const NodeTypes types = [] {
    NodeTypes some;
    register_drive_arbiter(some);
    return some;
  }();
  return *types.find("drive_arbiter");
}

struct Fixture : NodeTest<> {
  double client_m_s = 0.5, tracking_m_s = 0.8;

  Fixture() : NodeTest(arbiter().make()) {
    for (const char* name : {"client", "tracking"}) connect(name);
    connect("wanted", {0, 0, 1, 32});
  }
  /// Both ask; a null word: nobody says `wanted`.
  std::string job(const char* word = nullptr, bool client_is_stale = false) {
    if (word) {
      TextStatus& wanted = put<TextStatus>("wanted", 0);
      for (const char* c = word; *c; ++c) wanted.text.push_back(*c);
    } else empty("wanted");
    put<VelocityCommand>("client", 700).speed_m_s = client_m_s;
    if (client_is_stale) make_stale("client");
    put<VelocityCommand>("tracking", 800).speed_m_s = tracking_m_s;
    run();
    if (counting_allocations()) CHECK(allocations() == 0);
    REQUIRE(out<VelocityCommand>("velocity"));
    REQUIRE(out<DigitalState>("refused"));
    const auto text = out<TextStatus>("state")->text.items();
    return {text.begin(), text.end()};
  }
  const VelocityCommand& velocity() { return *out<VelocityCommand>("velocity"); }
  const DigitalState& refused() { return *out<DigitalState>("refused"); }
};

}  // namespace

TEST_CASE("drive_arbiter lets one pass, as the state says, and tells the other") {
  CHECK(arbiter().layer == Layer::processing);
  Fixture f;
  CHECK(f.job() == "search");
  CHECK(f.velocity().speed_m_s == 0.5);
  CHECK(f.stamp_ns("velocity") == 700);
  CHECK(f.refused().levels == 2);
  CHECK(f.refused().changed == 2);
  CHECK(f.job("tracking") == "tracking");
  CHECK(f.velocity().speed_m_s == 0.8);
  CHECK(f.stamp_ns("velocity") == 800);
  CHECK(f.refused().levels == 1);
  CHECK(f.refused().changed == 3);
  CHECK(f.job("pose") == "pose");
  CHECK(f.velocity().speed_m_s == 0);
  CHECK(f.refused().levels == 3);
  CHECK(f.job("dancing") == "pose");  // no such state
  CHECK(f.job() == "search");         // nobody says one any more
  f.tracking_m_s = 0;
  CHECK(f.job() == "search");
  CHECK(f.refused().levels == 0);  // who does not ask is not refused
}

TEST_CASE("drive_arbiter: a driver that falls silent stands, and the other does not take its place") {
  Fixture f;
  f.job("search", true);
  CHECK(f.velocity().speed_m_s == 0);
  CHECK(f.velocity().turn_rad_s == 0);
  CHECK(f.stamp_ns("velocity") == f.test::NodeRun::job().release_ns());
  CHECK(f.refused().levels == 2);
}

TEST_CASE("drive_arbiter: the state of its parameter holds while nobody says another, and may be set between jobs") {
  Fixture f;
  f.set("state", std::string("tracking"));
  CHECK(f.job() == "tracking");
  CHECK(f.velocity().speed_m_s == 0.8);
  CHECK(f.job("search") == "search");
  f.set("state", std::string("pose"));
  CHECK(f.job() == "pose");
}
