// SPDX-License-Identifier: Apache-2.0
// Server and clients over a network of memory, on virtual time.
#include <doctest/doctest.h>

#include <map>
#include <optional>

#include "hal/semantic_link/client.hpp"
#include "hal/semantic_link/link_device.hpp"
#include "hal/semantic_link/server.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/odometry.hpp"
#include "tests/conformance/link_messages.hpp"
#include "tests/conformance/link_network.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::semantic_link;
using takt::test::Bytes, takt::test::MemoryNetwork;

namespace {

using test::kMs;

struct Fixture {
  VirtualClock clock{1'000'000'000};
  MemoryNetwork network;
  Key key{};
  Server server{network.server(), key, clock};
  Exchange& ace = *server.add_robot("ace");
  std::vector<LinkEnd*> ends{&server};

  std::unique_ptr<Client> client(const char* robot = "ace", std::optional<Key> other_key = {}) {
    auto made = std::make_unique<Client>(network.client(), other_key.value_or(key), robot, clock);
    ends.push_back(made.get());
    return made;
  }
  const LinkReport& report(Exchange& exchange) {
    if (const LinkReport* newest = exchange.report.take()) reports_[&exchange] = *newest;
    return reports_[&exchange];
  }
  void leave(const std::unique_ptr<Client>& client) { std::erase(ends, client.get()); }
  void run_ms(int64_t ms) {
    for (int64_t i = 0; i < ms; ++i) {
      clock.advance_to(clock.now_ns() + kMs);
      for (int round = 0; round < 2; ++round)
        for (LinkEnd* end : ends) end->step();
    }
  }

 private:
  std::map<Exchange*, LinkReport> reports_;
};

void give(Exchange& exchange, Kind kind, uint32_t number, int64_t stamp_ns) {
  Placed message(info_of(kind));
  test::fill(kind, number, message.get());
  Parcel& draft = exchange.parcels[index_of(kind)].draft();
  draft.bytes.clear();
  REQUIRE(write_message(info_of(kind), message.get(), draft.bytes));
  draft.stamp_ns = stamp_ns;
  exchange.parcels[index_of(kind)].publish();
}

/// The number that a message which came was made of; 0: none came.
template <class Number>
uint32_t taken(Exchange& exchange, Kind kind, Number number) {
  const Parcel* parcel = exchange.parcels[index_of(kind)].take();
  if (parcel == nullptr) return 0;
  Placed message(info_of(kind));
  REQUIRE(LinkDevice::unpack(kind, *parcel, message.get()));
  return number(message);
}
uint32_t odometry(Exchange& exchange) {
  return taken(exchange, Kind::odometry, [](Placed& m) { return static_cast<uint32_t>(m.as<Odometry>().x_m); });
}
uint32_t task(Exchange& exchange) {
  return taken(exchange, Kind::task, [](Placed& m) { return m.as<RobotTask>().number; });
}
uint32_t outcome(Exchange& exchange) {
  return taken(exchange, Kind::outcome, [](Placed& m) { return m.as<ActionOutcome>().number; });
}

}  // namespace

TEST_CASE("a client is welcomed, and messages go both ways once each, with their stamps") {
  Fixture f;
  const auto client = f.client();
  f.run_ms(5);
  CHECK(f.report(f.ace).attached);
  CHECK(f.report(client->exchange()).attached);
  give(f.ace, Kind::odometry, 3, 123);
  give(client->exchange(), Kind::task, 4, 456);
  f.run_ms(1);
  const Parcel* parcel = client->exchange().parcels[index_of(Kind::odometry)].take();
  REQUIRE(parcel != nullptr);
  CHECK(parcel->stamp_ns == 123);
  CHECK(task(f.ace) == 4);
  f.run_ms(1000);
  CHECK(odometry(client->exchange()) == 0);
  CHECK(task(f.ace) == 0);  // repeated on the line, handed over once
  const LinkCounts counts = f.report(f.ace).counts;
  CHECK(counts.replayed + counts.foreign + counts.damaged + counts.malformed + counts.late + counts.lost == 0);
}

TEST_CASE("what lasts reaches a client that comes later, what does not is not kept for it") {
  Fixture f;
  give(f.ace, Kind::outcome, 7, 1);
  give(f.ace, Kind::odometry, 7, 1);
  f.run_ms(300);
  const auto client = f.client();
  f.run_ms(5);
  CHECK(outcome(client->exchange()) == 7);
  CHECK(odometry(client->exchange()) == 0);
}

TEST_CASE("a message in fragments arrives whole, and one that is lost is made whole by its repetition") {
  Fixture f;
  f.network.largest = 100;
  const auto client = f.client();
  f.run_ms(5);
  give(client->exchange(), Kind::action, 5, 1);  // 36 + 32 + 128 bytes
  const size_t before = f.network.history.size();
  client->step();
  CHECK(f.network.history.size() - before == 3);
  f.run_ms(1);
  CHECK(taken(f.ace, Kind::action, [](Placed& m) { return m.as<ActionCommand>().number; }) == 5);
}

TEST_CASE("who asks for a robot that is not there, or is taken, is refused and told why") {
  Fixture f;
  const auto first = f.client();
  f.run_ms(5);
  const auto second = f.client(), wrong = f.client("eve");
  f.run_ms(150);
  CHECK(f.report(first->exchange()).attached);
  const LinkReport &refused = f.report(second->exchange()), unknown = f.report(wrong->exchange());
  CHECK_FALSE(refused.attached);
  CHECK(std::string(refused.trouble) == "the robot has a client already");
  CHECK(std::string(unknown.trouble) == "the server has no robot of this name");
  CHECK(f.report(f.ace).counts.refused == 4);
  first->say_farewell();
  f.leave(first);
  f.run_ms(150);
  CHECK(f.report(second->exchange()).attached);
}

TEST_CASE("several robots at one server, each with its own client") {
  Fixture f;
  Exchange* eve = f.server.add_robot("eve");
  REQUIRE(eve != nullptr);
  CHECK(f.server.add_robot("ace") == nullptr);
  const auto first = f.client("ace"), second = f.client("eve");
  f.run_ms(5);
  give(f.ace, Kind::odometry, 1, 1);
  give(*eve, Kind::odometry, 2, 1);
  f.run_ms(1);
  CHECK(odometry(first->exchange()) == 1);
  CHECK(odometry(second->exchange()) == 2);
}

TEST_CASE("after silence either end gives the session up, and they find each other again") {
  Fixture f;
  const auto client = f.client();
  f.run_ms(10);
  f.ends = {client.get()};  // the server does not answer
  f.run_ms(1100);
  CHECK_FALSE(f.report(client->exchange()).attached);
  CHECK(std::string(f.report(client->exchange()).trouble) == "the server does not answer");
  f.ends = {&f.server};  // the client is gone; what it said while the server slept is old
  f.run_ms(1100);
  CHECK_FALSE(f.report(f.ace).attached);
  f.ends = {&f.server, client.get()};
  f.run_ms(110);
  CHECK(f.report(f.ace).attached);
  CHECK(f.report(client->exchange()).attached);
}

TEST_CASE("a server that was started again is found within a second, though it knows nothing of the session") {
  Fixture f;
  const auto client = f.client();
  f.run_ms(10);
  Server again(f.network.server(), f.key, f.clock);
  Exchange* ace = again.add_robot("ace");
  f.ends = {&again, client.get()};
  f.run_ms(1150);
  CHECK(f.report(*ace).attached);
  CHECK(f.report(client->exchange()).attached);
}

TEST_CASE("replayed datagrams, of this session or of an earlier one, change nothing and are counted") {
  Fixture f;
  const auto client = f.client();
  f.run_ms(5);
  give(client->exchange(), Kind::velocity, 100, f.clock.now_ns());
  f.run_ms(200);
  CHECK(taken(f.ace, Kind::velocity, [](Placed&) { return 1u; }) == 1);
  const auto recorded = f.network.history;
  const auto replay = [&] {
    for (const auto& sent : recorded)
      if (sent.to == MemoryNetwork::kServer) f.network.deliver(sent.from, sent.to, sent.bytes);
    f.run_ms(1);
  };
  const LinkCounts before = f.report(f.ace).counts;
  replay();
  LinkCounts counts = f.report(f.ace).counts;
  CHECK(counts.replayed - before.replayed > 4);
  CHECK(counts.foreign == before.foreign);
  CHECK(taken(f.ace, Kind::velocity, [](Placed&) { return 1u; }) == 0);
  CHECK(f.report(f.ace).attached);
  // Once the session is over its datagrams are those of a stranger; the old hello gets an answer that nobody takes up.
  client->say_farewell();
  f.leave(client);
  f.run_ms(5);
  CHECK_FALSE(f.report(f.ace).attached);
  replay();
  f.run_ms(200);
  counts = f.report(f.ace).counts;
  CHECK(counts.foreign > before.foreign + 4);
  CHECK_FALSE(f.report(f.ace).attached);
  CHECK(taken(f.ace, Kind::velocity, [](Placed&) { return 1u; }) == 0);
}

TEST_CASE("datagrams of others: with the session's numbers from another place, or without the key") {
  Fixture f;
  f.key[0] = 9;
  Server server(f.network.server(), f.key, f.clock);
  Exchange& ace = *server.add_robot("ace");
  f.ends = {&server};
  const auto client = f.client(), stranger = f.client("ace", Key{});
  f.run_ms(150);
  CHECK(f.report(client->exchange()).attached);
  CHECK_FALSE(f.report(stranger->exchange()).attached);
  CHECK(f.report(ace).counts.damaged == 2);  // its hellos
  Bytes stolen;
  for (const auto& sent : f.network.history)
    if (sent.to == MemoryNetwork::kServer && sent.bytes[5] == static_cast<uint8_t>(Kind::alive)) stolen = sent.bytes;
  f.network.deliver(static_cast<test::Peer>(99), MemoryNetwork::kServer, stolen);
  f.run_ms(1);
  CHECK(f.report(ace).counts.foreign == 1);
  CHECK(f.report(ace).attached);
}

TEST_CASE("bytes of no protocol are counted, at both ends, and end nothing") {
  Fixture f;
  const auto client = f.client();
  f.run_ms(5);
  for (const test::Peer to : {MemoryNetwork::kServer, static_cast<test::Peer>(2)}) {
    f.network.deliver(static_cast<test::Peer>(99), to, {});
    f.network.deliver(static_cast<test::Peer>(99), to, Bytes(70'000, 1));
    f.network.deliver(static_cast<test::Peer>(99), to, Bytes(100, 1));
  }
  f.run_ms(1);
  CHECK(f.report(f.ace).counts.malformed == 3);
  CHECK(f.report(client->exchange()).counts.malformed == 3);
  CHECK(f.report(f.ace).attached);
}
