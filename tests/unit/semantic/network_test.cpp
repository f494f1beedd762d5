// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/network.hpp"

#include <doctest/doctest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "rt/memory/memory_use.hpp"

using namespace takt;
using namespace takt::semantic;

namespace {

std::vector<NodeId> psi(const Network& network, NodeId node, Kind kind) {
  NodeSet set(network.capacity());
  network.psi(node, kind, set);
  return {set.items().begin(), set.items().end()};
}

using Ids = std::vector<NodeId>;

/// Thesis Eq. 5.6 to 5.8, node k at id k - 1.
Network worked_example() {
  Network network({8, 9});
  for (const auto& [kind, name] : std::initializer_list<std::pair<Kind, const char*>>{{Kind::object, "O1"},
                                                                                      {Kind::object, "O2"},
                                                                                      {Kind::type, "T3"},
                                                                                      {Kind::type, "T4"},
                                                                                      {Kind::attribute, "A5"},
                                                                                      {Kind::attribute, "A6"},
                                                                                      {Kind::attribute, "A7"},
                                                                                      {Kind::action, "C8"}})
    REQUIRE(network.add(kind, name));
  for (const auto& [a, b] : std::initializer_list<std::pair<NodeId, NodeId>>{
           {0, 2}, {0, 6}, {1, 3}, {2, 4}, {3, 4}, {3, 5}, {2, 7}, {3, 7}, {7, 4}})
    REQUIRE(network.connect(a, b));
  return network;
}

}  // namespace

TEST_CASE("oracle 23: Omega and the whole Psi table on the thesis's example") {
  const Network n = worked_example();
  const auto omega = [&](NodeId node, Kind kind) {
    const auto items = n.omega(node, kind);
    return Ids(items.begin(), items.end());
  };
  CHECK(omega(0, Kind::type) == Ids{2});
  CHECK(omega(0, Kind::attribute) == Ids{6});
  CHECK(omega(4, Kind::type) == Ids{2, 3});
  // object
  CHECK(psi(n, 0, Kind::object) == Ids{});
  CHECK(psi(n, 0, Kind::attribute) == Ids{4, 6});  // Eq. 5.7
  CHECK(psi(n, 0, Kind::type) == Ids{2});
  CHECK(psi(n, 0, Kind::action) == Ids{7});
  CHECK(psi(n, 1, Kind::attribute) == Ids{4, 5});
  CHECK(psi(n, 1, Kind::action) == Ids{7});  // Eq. 5.8
  // attribute
  CHECK(psi(n, 4, Kind::object) == Ids{0, 1});
  CHECK(psi(n, 5, Kind::object) == Ids{1});
  CHECK(psi(n, 6, Kind::object) == Ids{0});
  CHECK(psi(n, 4, Kind::attribute) == Ids{});
  CHECK(psi(n, 4, Kind::type) == Ids{2, 3});
  CHECK(psi(n, 4, Kind::action) == Ids{7});
  CHECK(psi(n, 6, Kind::action) == Ids{});
  // type
  CHECK(psi(n, 3, Kind::object) == Ids{1});
  CHECK(psi(n, 3, Kind::attribute) == Ids{4, 5});
  CHECK(psi(n, 3, Kind::type) == Ids{});
  CHECK(psi(n, 3, Kind::action) == Ids{7});
  // action
  CHECK(psi(n, 7, Kind::object) == Ids{0, 1});
  CHECK(psi(n, 7, Kind::attribute) == Ids{4});
  CHECK(psi(n, 7, Kind::type) == Ids{2, 3});
  CHECK(psi(n, 7, Kind::action) == Ids{});
}

TEST_CASE("oracle 23: only the connections of thesis Tab. 5.1") {
  constexpr bool kAllowed[4][4] = {{false, true, true, false},   // object
                                   {true, false, true, true},    // attribute
                                   {true, true, false, true},    // type
                                   {false, true, true, false}};  // action
  for (size_t a = 0; a < 4; ++a)
    for (size_t b = 0; b < 4; ++b) {
      Network network({2, 1});
      const NodeId first = *network.add(static_cast<Kind>(a), "a"), second = *network.add(static_cast<Kind>(b), "b");
      const auto connected = network.connect(first, second);
      CHECK(connected.has_value() == kAllowed[a][b]);
      CHECK(network.connected(first, second) == kAllowed[a][b]);
      CHECK(network.connected(second, first) == kAllowed[a][b]);
      if (!connected) CHECK(connected.error() == NetworkError::kinds);
    }
}

TEST_CASE("a network refuses names that are taken, empty or too long, and nodes beyond its capacity") {
  Network network({2, 1});
  REQUIRE(network.add(Kind::type, "chair"));
  CHECK(network.add(Kind::object, "chair").error() == NetworkError::name_taken);
  CHECK(network.add(Kind::object, "").error() == NetworkError::name);
  CHECK(network.add(Kind::object, std::string(32, 'x')).error() == NetworkError::name);
  REQUIRE(network.add(Kind::object, std::string(31, 'x')));
  CHECK(network.add(Kind::object, "more").error() == NetworkError::full);
  CHECK(network.find("chair") == 0);
  CHECK(network.find("table") == kNoNode);
}

TEST_CASE("a removed node leaves no link, and its place serves another") {
  Network network = worked_example();
  network.remove(3);  // T4
  CHECK_FALSE(network.exists(3));
  CHECK(psi(network, 1, Kind::attribute) == Ids{});
  CHECK(psi(network, 4, Kind::object) == Ids{0});
  CHECK(psi(network, 7, Kind::type) == Ids{2});
  CHECK(network.find("T4") == kNoNode);
  CHECK(*network.add(Kind::attribute, "A9") == 3);
  CHECK(psi(network, 3, Kind::type) == Ids{});
}

TEST_CASE("ten thousand objects come and go without memory being taken") {
  constexpr uint32_t kObjects = 10'000;
  Network network({kObjects + 1, kObjects});
  const NodeId type = *network.add(Kind::type, "chair");
  const uint64_t before = thread_memory_use().allocations;
  for (int round = 0; round < 3; ++round) {
    for (uint32_t i = 0; i < kObjects; ++i) {
      char name[8] = {};
      std::snprintf(name, sizeof name, "%u", i);
      const auto node = network.add(Kind::object, name);
      REQUIRE(node);
      REQUIRE(network.connect(*node, type));
    }
    REQUIRE(network.omega(type, Kind::object).size() == kObjects);
    while (!network.omega(type, Kind::object).empty()) network.remove(network.omega(type, Kind::object).back());
  }
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  CHECK(network.size() == 1);
}
