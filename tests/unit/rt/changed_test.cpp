// SPDX-License-Identifier: Apache-2.0
// Which parameters a run can set, and what a node makes anew of them.
#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

#include "rt/node.hpp"
#include "rt/testing.hpp"

using namespace takt;

namespace {

/// Makes something of each pair of parameters in setup; of some of them anew in changed().
struct Maker final : Node {
  Param<double> low{this, "low", 1.0, {0.0, 10.0}, "1", "made anew"};
  Param<double> high{this, "high", 2.0, {0.0, 10.0}, "1", "made anew"};
  Param<int> room{this, "room", 4, {1, 9}, "", "sizes memory, and is read again", kSizesMemory};
  Param<int> forgotten{this, "forgotten", 4, {1, 9}, "", "read in setup alone"};
  Param<int> in_jobs{this, "in_jobs", 4, {1, 9}, "", "read in jobs alone"};
  Param<std::string> file{this, "file", "", kPath, "not read at all"};
  Choice kind{this, "kind", "sum", {"sum", "product"}, "made anew"};
  double made = 0;
  int times = 0;
  void setup(Setup&) override {
    static_cast<void>(forgotten());
    make();
  }
  void changed() override {
    ++times;
    make();
  }
  void run(Job&) override {}

 private:
  void make() {
    made = 0;
    static_cast<void>(room());
    if (low >= high) throw SetupError("low is " + low.value_text() + ", must lie below high = " + high.value_text());
    made = kind() == 0 ? low + high : low * high;
  }
};

size_t index_of(const Node& node, std::string_view name) {
  for (size_t p = 0; p < node.params().size(); ++p)
    if (node.params()[p]->name() == name) return p;
  throw std::logic_error("no such parameter");
}

}  // namespace

TEST_CASE("live is what is not declared fixed, and what changed() reads again of all that setup() read") {
  Maker node;
  test::set_up(node);
  CHECK(node.times == 1);
  const auto live = [&](std::string_view name) { return node.params()[index_of(node, name)]->live(); };
  for (const char* name : {"low", "high", "in_jobs", "kind"}) CHECK(live(name));
  for (const char* name : {"room", "forgotten", "file"}) CHECK_FALSE(live(name));
  CHECK(node.room.fixed() == "sizes memory");
  CHECK(node.file.fixed() == "read at start");
  CHECK(node.forgotten.fixed().empty());
  CHECK(node.low.fixed().empty());
}

TEST_CASE("a change is made anew before the next job; one that does not fit the others leaves all as it was") {
  Maker node;
  test::set_up(node);
  REQUIRE(node.change(index_of(node, "high"), 5.0));
  CHECK(node.made == 6);
  const auto refused = node.change(index_of(node, "low"), 7.0);
  REQUIRE_FALSE(refused);
  CHECK(refused.error() == "low is 7, must lie below high = 5");
  CHECK(node.low() == 1);
  CHECK(node.made == 6);
  REQUIRE(node.change(index_of(node, "kind"), std::string("product")));
  CHECK(node.made == 5);
  CHECK_FALSE(node.change(index_of(node, "kind"), std::string("quotient")));
  CHECK_FALSE(node.change(index_of(node, "low"), 11.0));
  CHECK(node.kind.word() == "product");
  CHECK(node.made == 5);
}

TEST_CASE("the value of a parameter is what it can be set to again") {
  Maker node;
  for (ParamBase* param : node.params()) {
    CAPTURE(param->name());
    const std::string before = param->value_text();
    REQUIRE(param->set(param->value()));
    CHECK(param->value_text() == before);
  }
}

TEST_CASE("a node under test is set as one that runs") {
  NodeTest<Maker> test;
  test.set("high", 3.0);
  test.start();
  CHECK(test.node().made == 4);
  test.set("low", 2.0);
  CHECK(test.node().made == 5);
  CHECK_THROWS_WITH_AS(test.set("low", 3.0), "low low is 3, must lie below high = 3", std::logic_error);
  CHECK_THROWS_AS(test.set("room", int64_t{5}), std::logic_error);
}
