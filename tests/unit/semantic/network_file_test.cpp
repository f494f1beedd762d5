// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/network_file.hpp"

#include <doctest/doctest.h>

#include "nodes/semantic/network_text.hpp"
#include "nodes/semantic/similarity.hpp"

using namespace takt::semantic;

namespace {

MapParameters small() { return {{100, 300}, 0.3, 100, 100, -15, -15}; }

std::string mistakes(const std::string& text) {
  SemanticMap map(small());
  const auto read = parse_network(text, "n.yaml", map);
  std::string all;
  if (!read)
    for (const std::string& line : read.error()) all += line + "\n";
  return all;
}

}  // namespace

TEST_CASE("the shipped network holds what its file says") {
  SemanticMap map(small());
  const auto read = read_network(TAKT_SOURCE_DIR "/graph/networks/kitchen.yaml", map);
  REQUIRE_MESSAGE(read, read.error().front());
  const Network& n = map.network();
  const NodeId cup = n.find("cup_1"), level = n.find("level"), closed = n.find("closed"), fill = n.find("fill");
  CHECK(map.state(cup, level) == Value{Word{0}});
  CHECK(map.state(n.find("bottle_1"), closed) == Value{true});
  CHECK(map.object(cup).x_m == 2);
  NodeSet set(n.capacity());
  n.psi(cup, Kind::action, set);
  CHECK(std::vector(set.items().begin(), set.items().end()) == std::vector{fill});
  CHECK(map.action(fill).cost_s == 6);
  CHECK(n.connected(fill, closed));
  const NodeId type = n.find("cup");
  CHECK(map.weight({&type, 1}, n.find("colour")) == 2);
}

TEST_CASE("actions change states where what they require is true") {
  SemanticMap map(small());
  REQUIRE(read_network(TAKT_SOURCE_DIR "/graph/networks/kitchen.yaml", map));
  const Network& n = map.network();
  const Action &fill = map.action(n.find("fill")), &open = map.action(n.find("open"));
  const std::vector<NodeId> roles{n.find("cup_1"), n.find("bottle_1")};
  CHECK_FALSE(map.possible(fill, roles));
  const std::vector<NodeId> bottle{n.find("bottle_1")};
  REQUIRE(map.possible(open, bottle));
  map.apply(open, bottle);
  REQUIRE(map.possible(fill, roles));
  map.apply(fill, roles);
  CHECK(map.state(roles[0], n.find("level")) == Value{Word{1}});
  CHECK(map.state(roles[1], n.find("level")) == Value{Word{0}});
}

TEST_CASE("every mistake of a file is told, where it stands and with what is valid") {
  CHECK(mistakes("takt_network: 1\n") == "");
  CHECK(mistakes("takt_network: 1\nthings: {}\n") ==
        "n.yaml:2:1: unknown key `things`; valid are: takt_network, attributes, types, actions, objects\n");
  CHECK(mistakes("attributes: {}\n") == "n.yaml:1:1: `takt_network: 1` is missing\n");
  CHECK(mistakes("takt_network: 1\nattributes:\n  a: {kind: bool}\n  m: {kind: scalar, range: [0kg, 5g]}\n"
                 "  e: {kind: enumerated, words: [one]}\n  a: {kind: boolean}\n") ==
        "n.yaml:3:13: `a` needs a kind; valid are: scalar, boolean, colour, enumerated\n"
        "n.yaml:4:29: `0kg` is no value of it; valid: -1e+12g .. 1e+12g\n"
        "n.yaml:5:32: `e` needs at least two words such as [empty, full]\n"
        "n.yaml:6:3: duplicate key `a`\n");
  const std::string head =
      "takt_network: 1\nattributes: {on: {kind: boolean}, m: {kind: scalar, range: [0kg, 5kg]}}\n"
      "types: {lamp: {attributes: [on]}, door: {}}\n";
  CHECK(mistakes(head) == "");
  CHECK(mistakes(head +
                 "actions:\n  light: {roles: {l: lamp}, cost: 3, requires: {l.of: false}, results: {x.on: true}}\n") ==
        "n.yaml:5:35: `3` is no value of it; valid: 0s .. 1e+06s\n"
        "n.yaml:5:55: there is no attribute `of`; valid are: on, m\n"
        "n.yaml:5:79: `x.on` names no attribute of a role; valid are: l.ATTRIBUTE\n"
        "n.yaml:5:10: `light` has no results, so nothing is ever done for its sake\n");
  CHECK(mistakes(head + "actions:\n  weigh: {roles: {l: lamp}, results: {l.m: 2kg}}\n") ==
        "n.yaml:5:44: `l.m`: the type lamp has no such attribute\n"
        "n.yaml:5:10: `weigh` has no results, so nothing is ever done for its sake\n");
  CHECK(mistakes(head +
                 "objects:\n  l: {type: lamb, at: [1m, 2]}\n  on: {type: door, at: [1m, 2m]}\n"
                 "  d: {type: door, at: [1m, 99m]}\n  e: {type: lamp, at: [1m, 2m], states: {m: 7kg, on: yes}}\n") ==
        "n.yaml:5:13: there is no type `lamb`; valid are: lamp, door\n"
        "n.yaml:5:28: `2` is no value of it; valid: -1e+06m .. 1e+06m\n"
        "n.yaml:6:7: `on`: another node has this name\n"
        "n.yaml:7:6: `d`: lies outside of the map\n"
        "n.yaml:8:45: `m`: `7kg` is no value of it; valid: 0kg .. 5kg\n"
        "n.yaml:8:54: `on`: `yes` is no value of it; valid: true, false\n");
  CHECK(mistakes("takt_network: [1\n").starts_with("n.yaml:2:1: "));
  SemanticMap map(small());
  CHECK(read_network("/nowhere.yaml", map).error().front() ==
        "/nowhere.yaml:1:1: cannot be read: No such file or directory");
}

TEST_CASE("a network as DOT and as GraphML: every node and every link once") {
  SemanticMap map(small());
  REQUIRE(
      parse_network("takt_network: 1\nattributes: {on: {kind: boolean}}\ntypes: {\"a<b\": {attributes: [on]}}\n"
                    "objects: {o: {type: \"a<b\", at: [1m, 2m], states: {on: true}}}\n",
                    "n.yaml", map));
  CHECK(to_dot(map) ==
        "graph semantic_network {\n"
        "  n2 [label=\"o\\non=true\", shape=ellipse];\n"
        "  n0 [label=\"on\", shape=note];\n"
        "  n1 [label=\"a<b\", shape=box];\n"
        "  n0 -- n1 [label=\"has attribute\"];\n"
        "  n1 -- n2 [label=\"is of type\"];\n"
        "}\n");
  const std::string graphml = to_graphml(map);
  CHECK(graphml.find("<node id=\"n1\"><data key=\"name\">a&lt;b</data><data key=\"kind\">type</data></node>") !=
        std::string::npos);
  CHECK(graphml.find("<data key=\"x\">1</data><data key=\"y\">2</data><data key=\"states\">on=true</data>") !=
        std::string::npos);
  CHECK(graphml.find("<edge source=\"n1\" target=\"n2\"><data key=\"relation\">is of type</data></edge>") !=
        std::string::npos);
}

TEST_CASE("an attribute of the weight 0 tells no two objects apart") {
  SemanticMap map(small());
  REQUIRE(
      parse_network("takt_network: 1\nattributes: {level: {kind: enumerated, words: [empty, full]}}\n"
                    "types: {cup: {attributes: {level: 0}}}\n"
                    "objects: {cup_1: {type: cup, at: [1m, 2m], states: {level: empty}}}\n",
                    "n.yaml", map));
  const State full{map.network().find("level"), Word{1}};
  Similarity similarity(map, {});
  const Comparison same = similarity.compare(
      {.type = map.network().find("cup"), .x_m = 1, .y_m = 2, .states = {&full, 1}}, map.network().find("cup_1"));
  CHECK(same.p == 1);
  CHECK(mistakes("takt_network: 1\nattributes: {level: {kind: boolean}}\ntypes: {cup: {attributes: {level: -1}}}\n")
            .find("n.yaml:3") != std::string::npos);
}
