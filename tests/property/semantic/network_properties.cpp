// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <map>
#include <random>
#include <set>
#include <string>

#include "nodes/semantic/network.hpp"
#include "tests/property_scale.hpp"

using namespace takt::semantic;

namespace {

using Set = std::set<NodeId>;

/// The definitions, over a set of edges.
struct Slow {
  std::map<NodeId, Kind> kind;
  std::set<std::pair<NodeId, NodeId>> edges;

  Set omega(NodeId r, Kind k) const {
    Set out;
    for (const auto& [a, b] : edges) {
      if (a == r && kind.at(b) == k) out.insert(b);
      if (b == r && kind.at(a) == k) out.insert(a);
    }
    return out;
  }
  Set omega(const Set& nodes, Kind k) const {
    Set out;
    for (const NodeId r : nodes) out.merge(omega(r, k));
    return out;
  }
  /// Eq. 5.5a to 5.5p, row by row.
  Set psi(NodeId r, Kind k) const {
    const auto joined = [](Set a, Set b) { return a.merge(b), a; };
    switch (kind.at(r)) {
      case Kind::object:
        switch (k) {
          case Kind::object: return {};
          case Kind::attribute: return joined(omega(r, k), omega(omega(r, Kind::type), k));
          case Kind::type: return omega(r, k);
          case Kind::action: return omega(omega(r, Kind::type), k);
        }
        break;
      case Kind::attribute:
        switch (k) {
          case Kind::object: return joined(omega(r, k), omega(omega(r, Kind::type), k));
          case Kind::attribute: return {};
          case Kind::type:
          case Kind::action: return omega(r, k);
        }
        break;
      case Kind::type: return k == Kind::type ? Set{} : omega(r, k);
      case Kind::action:
        switch (k) {
          case Kind::object: return omega(omega(r, Kind::type), k);
          case Kind::attribute:
          case Kind::type: return omega(r, k);
          case Kind::action: return {};
        }
        break;
    }
    return {};
  }
};

}  // namespace

TEST_CASE("Omega and Psi of a network that grows and shrinks are those of their definitions") {
  constexpr Kind kKindsOf[] = {Kind::object, Kind::attribute, Kind::type, Kind::action};
  std::mt19937 random(takt::test::seed(7));
  const auto below = [&](size_t n) { return static_cast<NodeId>(random() % n); };
  size_t compared = 0;
  for (int round = 0; round < takt::test::rounds(60); ++round) {
    Network network({60, 300});
    Slow slow;
    NodeSet set(60);
    for (int change = 0; change < 250; ++change) {
      const auto any = [&] { return std::next(slow.kind.begin(), below(slow.kind.size()))->first; };
      const auto what = below(10);
      if (what < 3 || slow.kind.size() < 2) {
        const Kind kind = kKindsOf[below(4)];
        const auto node = network.add(kind, std::to_string(change));
        REQUIRE(node.has_value() == (slow.kind.size() < 60));
        if (node) slow.kind[*node] = kind;
      } else if (what < 9) {
        const NodeId a = any(), b = any();
        const bool allowed = connectable(slow.kind[a], slow.kind[b]);
        REQUIRE(network.connect(a, b).has_value() == allowed);
        if (allowed) slow.edges.insert({std::min(a, b), std::max(a, b)});
      } else {
        const NodeId gone = any();
        network.remove(gone);
        slow.kind.erase(gone);
        std::erase_if(slow.edges, [&](const auto& edge) { return edge.first == gone || edge.second == gone; });
      }
      if (change % 10 != 0) continue;
      for (const auto& [node, kind] : slow.kind)
        for (const Kind k : kKindsOf) {
          const auto omega = network.omega(node, k);
          const Set expected = slow.omega(node, k), psi = slow.psi(node, k);
          REQUIRE(std::equal(omega.begin(), omega.end(), expected.begin(), expected.end()));
          network.psi(node, k, set);
          REQUIRE(std::equal(set.items().begin(), set.items().end(), psi.begin(), psi.end()));
          compared += psi.size();
          for (const NodeId other : psi)  // duality
            if (k != Kind::type && kind != Kind::type) REQUIRE(slow.psi(other, kind).contains(node));
        }
    }
  }
  CHECK(compared >= takt::test::at_scale(10'000));
}
