// SPDX-License-Identifier: Apache-2.0
#include "graph/check/lane_pieces.hpp"

#include <doctest/doctest.h>

#include <set>

#include "plans.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;

namespace {

/// Deadlines as bounds on what is done, counted from the head.
std::vector<PieceSet> pieces_of(const Plan& plan, Splitting splitting, std::vector<int64_t> done_by_ms = {}) {
  std::vector<int64_t> done_by_ns(plan.tasks.size(), 0);
  for (size_t t = 0; t < done_by_ms.size(); ++t) done_by_ns[t] = done_by_ms[t] * kMs;
  return lane_pieces(plan, lane_tasks(plan, plan.policy), {}, done_by_ns, splitting);
}

std::string members(const Plan& plan, const PieceSet& way) {
  std::string text;
  const auto lanes = lane_tasks(plan, plan.policy).lanes;
  for (const Piece& piece : way.pieces) {
    for (const size_t m : piece.members) text += plan.tasks[lanes[piece.lane][m]].name;
    text += ' ';
  }
  return text;
}

Plan lane_of(size_t followers) {
  Plan plan = plan_of(Policy::fixed, {0}, {task("a", 10, 1, 20)});
  for (size_t f = 0; f < followers; ++f) {
    plan.tasks.push_back(task(std::string(1, static_cast<char>('b' + f)), 10, 1, 20));
    follow(plan, f + 1, f);
  }
  return plan;
}

}  // namespace

TEST_CASE("lane pieces: a lane is cut where its worker waits") {
  Plan plan = lane_of(3);
  CHECK(members(plan, pieces_of(plan, {true, true})[0]) == "abcd ");
  plan.tasks[1].publish = PublishAt::let;  // b is done by 20 + 20, a between 0 and 15
  const PieceSet way = pieces_of(plan, {true, true}, {15, 35, 55, 75})[0];
  REQUIRE(members(plan, way) == "ab cd ");
  CHECK(way.pieces[1].ready_ns == 20 * kMs);
  CHECK(way.pieces[1].ready_by_ns == 35 * kMs);
  CHECK(way.pieces[1].prompt);
  CHECK(way.set.tasks[1].name == "c");
  CHECK(way.set.tasks[1].offset == 20 * kMs);
  CHECK(way.set.tasks[1].jitter == 15 * kMs);
  CHECK(way.set.tasks[1].budget == 2 * kMs);
  CHECK(way.set.tasks[0].budget == 2 * kMs);
  CHECK(way.set.tasks[0].deadline == 80 * kMs);  // four times 20
  CHECK(way.set.tasks[1].deadline == 60 * kMs);
  const PieceSet whole = pieces_of(plan, {false, true})[0];
  CHECK(members(plan, whole) == "abcd ");
  CHECK(whole.pieces[0].waits);
  CHECK(whole.set.tasks[0].budget == 1 * kMs + 20 * kMs + 2 * kMs);
}

TEST_CASE("lane pieces: nobody waits for what is surely seen by then") {
  Plan plan = lane_of(3);
  follow(plan, 2, 0);  // a is followed by b and c, b by d
  follow(plan, 3, 1);
  plan.tasks[0].publish = PublishAt::let;
  CHECK(members(plan, pieces_of(plan, {true, false}, {20, 40, 40, 60})[0]) == "a bcd ");
  plan.tasks[1].publish = PublishAt::let;
  CHECK(members(plan, pieces_of(plan, {true, false}, {20, 40, 40, 60})[0]) == "a bc d ");
}

TEST_CASE("lane pieces: a piece is not ready before the one that the pass comes to first") {
  Plan plan = lane_of(4);
  follow(plan, 2, 0);  // a is followed by b and c, which are both waited for: b, long, by d and c, short, by e
  follow(plan, 3, 1);
  follow(plan, 4, 2);
  plan.tasks[1].publish = plan.tasks[2].publish = PublishAt::let;
  plan.tasks[1].deadline_ns = 50 * kMs;
  const PieceSet way = pieces_of(plan, {true, false}, {60, 0, 0, 0, 0})[0];
  REQUIRE(members(plan, way) == "abc d e ");
  CHECK(way.pieces[1].ready_ns == 50 * kMs);
  CHECK(way.pieces[1].ready_by_ns == 110 * kMs);
  CHECK(way.pieces[2].ready_ns == 50 * kMs);
  CHECK(way.pieces[2].ready_by_ns == 110 * kMs);
  CHECK(!way.pieces[2].prompt);
}

TEST_CASE("lane pieces: each way in which seldom members may fall") {
  Plan plan = lane_of(2);
  plan.tasks[1].every = 2;  // c with it
  std::multiset<std::string> ways;
  for (const PieceSet& way : pieces_of(plan, {true, true})) ways.insert(members(plan, way));
  CHECK(ways == std::multiset<std::string>{"abc a ", "a abc "});

  const PieceSet way = pieces_of(plan, {true, true})[1];
  CHECK(way.set.tasks[0].period == 200 * kMs);
  CHECK(way.set.tasks[1].offset - way.set.tasks[0].offset == 100 * kMs);
  CHECK(way.set.tasks[0].deadline == 60 * kMs);

  plan.tasks[2].every = 2;  // of b's messages each second
  ways.clear();
  for (const PieceSet& each : pieces_of(plan, {true, true})) ways.insert(members(plan, each));
  CHECK(ways == std::multiset<std::string>{"abc a ab a ", "ab a abc a ", "a abc a ab ", "a ab a abc "});

  plan.tasks[2].on_task = 0;  // and of a's: both move by themselves
  ways.clear();
  for (const PieceSet& each : pieces_of(plan, {true, true})) ways.insert(members(plan, each));
  CHECK(ways == std::multiset<std::string>{"abc a ", "a abc ", "ab ac ", "ac ab "});
  CHECK(pieces_of(plan, {true, false}).size() == 1);

  plan.tasks[2].every = 1000;  // more than are told apart
  REQUIRE(pieces_of(plan, {true, true}).size() == 1);
  CHECK(members(plan, pieces_of(plan, {true, true})[0]) == "abc ");
}

TEST_CASE("lane pieces: what is nobody's stays behind them") {
  Plan plan = lane_of(1);
  analysis::Overheads o;
  o.ordinary_runtime_ns = 50 * kMs;
  o.ordinary_period_ns = 1000 * kMs;
  const PieceSet way = lane_pieces(plan, lane_tasks(plan, plan.policy, o), o, {0, 0}, {true, true})[0];
  REQUIRE(way.set.tasks.size() == way.pieces.size() + 1);
  CHECK(way.set.tasks.back().deferrable);
}
