// SPDX-License-Identifier: Apache-2.0
// What every server of the semantic interface owes its client, whatever feeds it and whatever lies between: the
// simulator and made messages, over memory, UDP and D-Bus; undisturbed, and with 30 % of all datagrams lost, 20 %
// doubled and each late by a time of its own.
#include <optional>

#include "rt/msg/velocity_command.hpp"
#include "tests/conformance/private_bus.hpp"
#include "tests/conformance/semantic_link/feeds.hpp"

using namespace takt;
using namespace takt::test;

namespace {

constexpr Impairment kNone{};
constexpr Impairment kBad{0.3, 0.2, 30 * kMs, 11};

/// Each message that came is one that was given, in the order in which they were, none twice, with its own stamp on the
/// client's clock. Returns how many came.
size_t check_stream(LinkRig& rig, Kind kind, int64_t to_client_ns, int64_t stamp_error_ns) {
  const auto& given = rig.given[kind];
  size_t next = 0, came = 0;
  for (const Passed& message : rig.received[kind]) {
    while (next < given.size() && given[next].bytes != message.bytes) ++next;
    REQUIRE_MESSAGE(next < given.size(), info_of(kind).name << ": a message that was not given, or out of order");
    CHECK(std::abs(message.stamp_ns - given[next].stamp_ns - to_client_ns) <= stamp_error_ns);
    ++next;
    ++came;
  }
  return came;
}

void check_messages(LinkRig& rig, bool impaired) {
  rig.run_for(2000 * kMs);
  REQUIRE_MESSAGE(rig.attached(), rig.client().line());
  CHECK(rig.client().state() == SourceState::ok);
  CHECK(rig.service().state() == SourceState::ok);
  auto before = rig.given;
  rig.received.clear();
  rig.run_for(20'000 * kMs);
  CHECK(rig.attached());
  // Half of a round trip's difference at most, that of the best in a second.
  const int64_t stamp_error_ns = impaired ? 30 * kMs : 0;
  for (const auto& [kind, given] : rig.given) {
    const size_t came = check_stream(rig, kind, kAhead_ns, stamp_error_ns);
    const size_t sent = given.size() - before[kind].size();
    const double share = static_cast<double>(came) / static_cast<double>(sent);
    CAPTURE(info_of(kind).name);
    CAPTURE(share);
    if (!impaired) CHECK(came + 1 >= sent);
    // What lasts is repeated until the next one; of the rest what is neither lost nor overtaken, of many fragments
    // less.
    else CHECK(share > (info_of(kind).lasting ? 0.9 : kind == Kind::objects ? 0.1 : 0.45));
  }
}

/// The client's words: an action and a task once each, whatever is lost.
void check_words(LinkRig& rig) {
  for (const Kind kind : {Kind::action, Kind::task}) {
    rig.received.clear();
    Chunk chunk(info_of(kind));
    fill(kind, 9, chunk.message());
    bool said = false;
    rig.run_for(3000 * kMs, true, [&](NodeBench& client) {
      if (!std::exchange(said, true)) client.latch(kind, chunk, rig.now_ns() + kAhead_ns);
    });
    REQUIRE(rig.received[kind].size() == 1);
    CHECK(rig.received[kind][0].bytes == chunk.bytes());
  }
}

/// The velocity of the client is the robot's until it falls silent; then it is zero within the watchdog's time.
void check_velocity(LinkRig& rig, int64_t slack_ns) {
  Chunk velocity(info_of(Kind::velocity));
  static_cast<VelocityCommand*>(velocity.message())->speed_m_s = 0.4;
  const auto drive = [&](NodeBench& client) { client.latch(Kind::velocity, velocity, rig.now_ns() + kAhead_ns); };
  CHECK(rig.commanded_m_s() == 0);
  rig.run_for(200 * kMs, true, drive);
  CHECK(rig.commanded_m_s() == 0.4);
  int stops = 0;
  for (int i = 0; i < 250; ++i) {
    rig.run_for(kLinkPeriod_ns, true, drive);
    stops += rig.commanded_m_s() != 0.4;
  }
  CHECK(stops <= 2);
  rig.run_for(300 * kMs + slack_ns + 2 * kLinkPeriod_ns, false);
  CHECK(rig.commanded_m_s() == 0);
}

void check_return(LinkRig& rig) {
  rig.run_for(1500 * kMs, false);  // the client is silent, the server forgets it
  CHECK(rig.service().state() == SourceState::silent);
  CHECK(rig.service().line().starts_with("not attached: no client"));
  rig.run_for(2500 * kMs);
  CHECK(rig.attached());
  rig.start_service();  // a server that knows nothing of the session
  rig.run_for(3000 * kMs);
  CHECK(rig.attached());
  CHECK(rig.client().state() == SourceState::ok);
  rig.start_client("nobody");
  rig.run_for(1500 * kMs);
  CHECK(rig.client().line().starts_with("not attached: the server has no robot of this name"));
  CHECK(rig.client().state() == SourceState::silent);
  rig.start_client("ace");
  rig.run_for(3000 * kMs);
  CHECK(rig.attached());
}

void check_client(const Line& line, const Impairment& impairment) {
  const bool impaired = impairment.loss > 0;
  {
    MessageFeed messages;
    LinkRig rig(line, impairment, messages);
    check_messages(rig, impaired);
    check_words(rig);
    check_velocity(rig, impairment.most_delay_ns);
    check_return(rig);
  }
  SimulatorFeed simulator;
  LinkRig rig(line, impairment, simulator);
  check_messages(rig, impaired);
  check_words(rig);
  check_velocity(rig, impairment.most_delay_ns);
  rig.run_for(500 * kMs, false);
  CHECK(std::abs(simulator.speed_m_s) < 0.01);  // the robot itself stands
  check_return(rig);
}

}  // namespace

TEST_CASE("the client's suite over memory") {
  MemoryNetwork network;
  check_client(memory_line(network), kNone);
}
TEST_CASE("the client's suite over memory impaired with ten seeds") {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    MemoryNetwork network;
    Impairment bad = kBad;
    bad.seed = 100 * seed;
    check_client(memory_line(network), bad);
  }
}
TEST_CASE("the client's suite over UDP") { check_client(udp_line(), kNone); }
TEST_CASE("the client's suite over UDP impaired") { check_client(udp_line(), kBad); }

TEST_CASE("the client's suite over D-Bus undisturbed and impaired; a bus that ends is a lost device") {
  PrivateBus bus;
  if (!bus.there()) {
    MESSAGE("NOT RUN: no dbus-daemon; apt-get install dbus-daemon");
    return;
  }
  for (const Impairment& impairment : {kNone, kBad}) check_client(dbus_line(bus.address()), impairment);
  MessageFeed messages;
  LinkRig rig(dbus_line(bus.address()), kNone, messages);
  rig.run_for(1000 * kMs);
  CHECK(rig.attached());
  bus.end();
  rig.run_for(100 * kMs);
  CHECK(rig.client().state() == SourceState::disconnected);
  CHECK(rig.service().state() == SourceState::disconnected);
}
