// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/digital_state.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "tests/unit/mapping_3d/node_harness.hpp"

namespace takt {
void register_drive_arbiter(NodeTypes& types);
}

using namespace takt;

namespace {

struct Fixture {
  VirtualClock clock;
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<VelocityCommand>> velocity;
  std::unique_ptr<test::BoxWriter<DigitalState>> refused;
  std::unique_ptr<test::BoxWriter<TextStatus>> state;
  test::Box<VelocityCommand> client, tracking;
  test::Box<TextStatus> wanted{{0, 0, 1, 32}};
  uint64_t jobs = 0;

  Fixture() {
    NodeTypes types;
    register_drive_arbiter(types);
    REQUIRE(types.find("drive_arbiter")->layer == Layer::processing);
    node = types.find("drive_arbiter")->make();
    for (const char* name : {"client", "tracking"}) PortAccess::connect(test::input(*node, name), {});
    PortAccess::connect(test::input(*node, "wanted"), {0, 0, 1, 32});
    test::set_up(*node);
    velocity = std::make_unique<test::BoxWriter<VelocityCommand>>(*node->outputs()[0]);
    refused = std::make_unique<test::BoxWriter<DigitalState>>(*node->outputs()[1]);
    state = std::make_unique<test::BoxWriter<TextStatus>>(*node->outputs()[2]);
    client->speed_m_s = 0.5, tracking->speed_m_s = 0.8;
  }
  /// Both ask; a null word: nobody says `wanted`.
  std::string job(const char* word = nullptr, bool client_is_stale = false) {
    ++jobs;
    auto& wants = test::input(*node, "wanted");
    wanted->text.resize(0);
    if (word) {
      for (const char* c = word; *c; ++c) wanted->text.push_back(*c);
      test::latch(wants, wanted, 0, jobs);
    } else {
      PortAccess::set_held(wants, 0, true, 0);
    }
    test::latch(test::input(*node, "client"), client, 700, jobs);
    if (client_is_stale) PortAccess::set_held(test::input(*node, "client"), 1, true, 0);
    test::latch(test::input(*node, "tracking"), tracking, 800, jobs);
    velocity->clear(), refused->clear(), state->clear();
    Job job(clock, jobs, 1000, 2000, 0, "full");
    const uint64_t before = thread_memory_use().allocations;
    node->run(job);
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    REQUIRE(velocity->sent());
    REQUIRE(refused->sent());
    const auto text = state->message().text.items();
    return {text.begin(), text.end()};
  }
  double speed() { return velocity->message().speed_m_s; }
  uint32_t losers() { return refused->message().levels; }
};

}  // namespace

TEST_CASE("drive_arbiter lets one pass, as the state says, and tells the other") {
  Fixture f;
  CHECK(f.job() == "search");
  CHECK(f.speed() == 0.5);
  CHECK(f.velocity->stamp_ns() == 700);
  CHECK(f.losers() == 2);
  CHECK(f.refused->message().changed == 2);
  CHECK(f.job("tracking") == "tracking");
  CHECK(f.speed() == 0.8);
  CHECK(f.velocity->stamp_ns() == 800);
  CHECK(f.losers() == 1);
  CHECK(f.refused->message().changed == 3);
  CHECK(f.job("pose") == "pose");
  CHECK(f.speed() == 0);
  CHECK(f.losers() == 3);
  CHECK(f.job("dancing") == "pose");  // no such state
  CHECK(f.job() == "search");         // nobody says one any more
  f.tracking->speed_m_s = 0;
  CHECK(f.job() == "search");
  CHECK(f.losers() == 0);  // who does not ask is not refused
}

TEST_CASE("drive_arbiter: a driver that falls silent stands, and the other does not take its place") {
  Fixture f;
  f.job("search", true);
  CHECK(f.speed() == 0);
  CHECK(f.velocity->message().turn_rad_s == 0);
  CHECK(f.velocity->stamp_ns() == 1000);
  CHECK(f.losers() == 2);
}

TEST_CASE("drive_arbiter: the state of its parameter holds while nobody says another, and may be set between jobs") {
  Fixture f;
  test::set(*f.node, "state", std::string("tracking"));
  CHECK(f.job() == "tracking");
  CHECK(f.speed() == 0.8);
  CHECK(f.job("search") == "search");
  test::set(*f.node, "state", std::string("pose"));
  CHECK(f.job() == "pose");
}
