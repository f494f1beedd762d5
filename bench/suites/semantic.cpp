// SPDX-License-Identifier: Apache-2.0
// The semantic network and the planner against the size of the network: 100, 1,000 and 10,000 objects of ten types. All
// objects that have an attribute, against the definition over a list of edges; an insertion, against a comparison with
// every object; a plan among as many bottles, against the recursion. Equal results are checked.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <stdexcept>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "nodes/planner/planner.hpp"
#include "nodes/semantic/insertion.hpp"

namespace takt::bench {

std::vector<Row> run_semantic(const Options& options);

namespace {

using namespace semantic;

constexpr size_t kSizes[] = {100, 1'000, 10'000};
constexpr size_t kTypes = 10, kQueries = 50;

Row row(const std::string& name) {
  std::fprintf(stderr, "%s\n", name.c_str());
  return {name, "us", 0, {}, {}, {}, {}, "one thread, CPU time"};
}

void must_agree(bool agree, const char* what) {
  if (!agree) throw std::runtime_error(fmt::format("semantic: {}: the fast result is not that of the reference", what));
}

/// Objects at random, as dense at every size; every second type has the attribute.
struct Large {
  SemanticMap map;
  NodeId colour, level;
  std::vector<NodeId> types;
  double side_m;
  std::vector<std::pair<NodeId, NodeId>> edges;

  explicit Large(size_t objects)
      : map({{objects + 200, 2 * objects + 200}, 0.3, 1000, 1000, 0, 0}),
        side_m(std::min(290.0, 2.5 * std::sqrt(static_cast<double>(objects)))) {
    colour = *map.add_attribute("colour", {ValueKind::colour, "", 0, 1, {}, false});
    level = *map.add_attribute("level", {ValueKind::enumerated, "", 0, 1, {"empty", "full"}, false});
    for (size_t t = 0; t < kTypes; ++t) {
      types.push_back(*map.add_type(fmt::format("type{}", t)));
      connect(types.back(), level);
      if (t % 2 == 0) connect(types.back(), colour);
    }
    std::mt19937_64 random(objects);
    std::uniform_real_distribution<double> place(0, side_m);
    for (size_t i = 0; i < objects; ++i) {
      const NodeId type = types[random() % kTypes], object = *map.add_object(type, place(random), place(random));
      edges.emplace_back(object, type);
      map.set_state(object, level, Word{1});
    }
  }
  void connect(NodeId type, NodeId attribute) {
    map.add_to_type(type, attribute);
    edges.emplace_back(type, attribute);
  }
  /// Psi_O of an attribute by its definition.
  std::vector<NodeId> objects_with(NodeId attribute) const {
    std::vector<NodeId> out;
    for (const auto& [type, a] : edges)
      if (a == attribute)
        for (const auto& [object, t] : edges)
          if (t == type) out.push_back(object);
    std::sort(out.begin(), out.end());
    return out;
  }
};

void add(std::vector<Row>& rows, const Options& options, const std::string& name, const char* reference, double share,
         const auto& theirs, const auto& ours) {
  Row figures = row(name);
  Compared compared = compare(
      static_cast<size_t>(options.rounds_or(9)), [&] { return cpu_ms(theirs) * share; },
      [&] { return cpu_ms(ours) * share; });
  figures.samples = std::move(compared.changed);
  add_pair(rows, std::move(figures), reference, compared.pairs);
}

void network_rows(std::vector<Row>& rows, const Options& options, size_t size) {
  constexpr double kUs = 1e3 / kQueries;
  Large large(size);
  NodeSet set(large.map.network().capacity());
  large.map.network().psi(large.colour, Kind::object, set);
  const auto slow = large.objects_with(large.colour);
  must_agree(std::equal(slow.begin(), slow.end(), set.items().begin(), set.items().end()), "objects of an attribute");
  add(
      rows, options, fmt::format("semantic/objects_of_attribute/{}", size), "every edge looked at", kUs,
      [&] {
        for (size_t i = 0; i < kQueries; ++i) large.objects_with(large.colour);
      },
      [&] {
        for (size_t i = 0; i < kQueries; ++i) large.map.network().psi(large.colour, Kind::object, set);
      });

  // A sighting of an object that is there, so that the size stays.
  Insertion insertion(large.map, {});
  Similarity similarity(large.map, {});
  std::mt19937_64 random(1);
  std::vector<Observation> seen;
  const std::vector<NodeId> objects = large.map.all(Kind::object);
  for (size_t i = 0; i < kQueries; ++i) {
    const NodeId object = objects[random() % objects.size()];
    seen.push_back({large.map.network().omega(object, Kind::type)[0],
                    large.map.object(object).x_m,
                    large.map.object(object).y_m,
                    1,
                    static_cast<int64_t>(i),
                    {}});
  }
  const auto most_similar = [&](const Observation& o) {
    NodeId best = kNoNode;
    double p = -1;
    for (const NodeId object : objects)
      if (const double other = similarity.compare(o, object).p; other > p) best = object, p = other;
    return best;
  };
  for (const Observation& o : seen) must_agree(insertion.insert(o).object == most_similar(o), "insertion");
  add(
      rows, options, fmt::format("semantic/insert/{}", size), "every object compared", kUs,
      [&] {
        for (const Observation& o : seen) most_similar(o);
      },
      [&] {
        for (const Observation& o : seen) insertion.insert(o);
      });
}

/// One empty cup among bottles, three of four closed.
void planner_rows(std::vector<Row>& rows, const Options& options, size_t size) {
  using namespace planner;
  SemanticMap map({{size + 10, 2 * size + 100}, 0.3, 1000, 1000, 0, 0});
  const NodeId level = *map.add_attribute("level", {ValueKind::enumerated, "", 0, 1, {"empty", "full"}, false}),
               closed = *map.add_attribute("closed", {}), cup = *map.add_type("cup"), bottle = *map.add_type("bottle");
  map.add_to_type(cup, level);
  map.add_to_type(bottle, level);
  map.add_to_type(bottle, closed);
  map.add_action("open", {{{"bottle", bottle}}, {{0, closed, true}}, {{0, closed, false}}, 4});
  map.add_action("fill", {{{"target", cup}, {"source", bottle}},
                          {{0, level, Word{0}}, {1, level, Word{1}}, {1, closed, false}},
                          {{0, level, Word{1}}, {1, level, Word{0}}},
                          6});
  std::mt19937_64 random(size);
  const double side_m = std::min(290.0, 2.5 * std::sqrt(static_cast<double>(size)));
  std::uniform_real_distribution<double> place(0, side_m);
  const NodeId target = *map.add_object(cup, side_m / 2, side_m / 2);
  map.set_state(target, level, Word{0});
  for (size_t i = 1; i < size; ++i) {
    const NodeId object = *map.add_object(bottle, place(random), place(random));
    map.set_state(object, level, Word{1});
    map.set_state(object, closed, i % 4 != 0);
  }
  const Goal goal{target, level, Word{1}};
  const takt::planner::Place robot{side_m / 2, 0};
  Row grounding = row(fmt::format("semantic/ground/{}", size));
  tl::expected<Domain, std::string> domain;
  for (int i = 0; i < options.rounds_or(9); ++i)
    grounding.samples.add(cpu_ms([&] { domain = ground(map, {&goal, 1}, robot, {}); }) * 1e3);
  grounding.value = grounding.samples.quantile(0.5).value_or(0);
  rows.push_back(grounding);
  if (!domain) throw std::runtime_error(domain.error());
  Planner best({}), recursive({Method::recursive, {}, {1, 1}});
  const auto plan = best.plan(*domain);
  must_agree(plan.verdict == Verdict::best && plan.cost_ns <= recursive.plan(*domain).cost_ns, "plan");
  add(
      rows, options, fmt::format("semantic/plan/{}", size), "the thesis's recursion", 1e3,
      [&] { recursive.plan(*domain); }, [&] { best.plan(*domain); });
}

}  // namespace

std::vector<Row> run_semantic(const Options& options) {
  std::vector<Row> rows;
  for (const size_t size : kSizes) {
    network_rows(rows, options, size);
    planner_rows(rows, options, size);
  }
  return rows;
}

}  // namespace takt::bench
