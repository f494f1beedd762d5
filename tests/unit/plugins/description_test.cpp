// SPDX-License-Identifier: Apache-2.0
// A registry that was described is, to all that do not run it, the one that it was described from.
#include "graph/plugins/description.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "graph/ace/ace_registry.hpp"
#include "graph/check/check.hpp"
#include "rt/msg/text_status.hpp"

using namespace takt;

namespace {

class Picky final : public Node {
 public:
  Picky() {
    both_.stamped_by({&second_});
    may(bit(JobCall::sleep), "it waits");
  }
  void setup(Setup&) override {}
  void run(Job&) override {}

 private:
  Input<TextStatus> first_{this, "first", "", Need::optional}, second_{this, "second", "the one that counts"};
  Output<TextStatus> both_{this, "both", ""}, any_{this, "any", "stamped by either"};
  Levels levels_{this, {{"full"}, {"half", 0.5, "coarse"}, {"none", 0.1}}};
  Param<double> angle_{
      this, "angle", std::numbers::pi, {-std::numbers::pi, std::numbers::pi}, "rad", "within its limits"};
  Param<double> tiny_{this, "tiny", 1.0 / 3, {1e-30 / 3, 1.0 / 3}, "m", ""};
  Param<double> any_number_{this, "any_number", 0.1, {-std::numeric_limits<double>::infinity(), 2.0 / 3}, "1", ""};
  Param<int> whole_{this, "whole", -3, {-3, 1'000'000'007}, "", ""};
  Param<bool> flag_{this, "flag", true, "", ""};
  Param<std::string> text_{this, "text", "a | b \"c\"", "", ""};
  Choice choice_{this, "choice", "second word", {"first", "second word", "third"}, ""};
};

class Own final : public ParamBase {
 public:
  explicit Own(Node* owner) : ParamBase(owner, "own", "", "") {}
  tl::expected<void, std::string> set(const ParamValue&) override { return {}; }
  std::string value_text() const override { return ""; }
  std::string range_text() const override { return ""; }
  std::string kind() const override { return "own"; }
};

class WithOwnParam final : public Node {
 public:
  void setup(Setup&) override {}
  void run(Job&) override {}
  Own own{this};
};

}  // namespace

TEST_CASE("what is described of the robot's registry is described of the description again") {
  const Registry robot = ace_registry();
  const std::string text = plugin::describe(Registry{}, robot);
  Registry known;
  plugin::Descriptions descriptions(known);
  descriptions.add(text);
  CHECK(plugin::describe(Registry{}, known) == text);
  CHECK(known.nodes.all().size() > 20);
  CHECK(graph::nodes_text(known.nodes) == graph::nodes_text(robot.nodes));
  for (const auto& [name, type] : robot.nodes.all())
    CHECK(graph::node_text(*known.nodes.find(name)) == graph::node_text(type));
  for (const hal::DeviceKind& kind : robot.devices.all())
    CHECK(graph::device_text(*known.devices.find(kind.name)) == graph::device_text(kind));
}

TEST_CASE("limits, stamps, levels and calls of a node are described exactly, and only what is new") {
  Registry before = ace_registry(), after = before;
  after.nodes.add<Picky>("picky", Layer::processing, "a node");
  const std::string text = plugin::describe(before, after);
  Registry known = before;
  plugin::Descriptions descriptions(known);
  descriptions.add(text);
  CHECK(known.nodes.all().size() == before.nodes.all().size() + 1);
  CHECK(plugin::describe(before, known) == text);
  const auto node = known.nodes.find("picky")->make();
  CHECK_FALSE(node->outputs()[0]->stamped_by(*node->inputs()[0]));
  CHECK(node->outputs()[0]->stamped_by(*node->inputs()[1]));
  CHECK(node->outputs()[1]->stamped_by(*node->inputs()[0]));
  CHECK(&node->outputs()[0]->type() == &MessageType::of<TextStatus>());
  CHECK(node->levels()[2].cost == 0.1);
  CHECK(node->allowed_calls() == bit(JobCall::sleep));
  CHECK(node->control() == node->inputs().back());
  const auto takes = [&](size_t param, double value) { return node->params()[param]->set(value).has_value(); };
  for (const auto& [param, low, high] :
       {std::tuple(size_t{0}, -std::numbers::pi, std::numbers::pi), {size_t{1}, 1e-30 / 3, 1.0 / 3}}) {
    CHECK(takes(param, low));
    CHECK(takes(param, high));
    CHECK_FALSE(takes(param, std::nextafter(low, -1e9)));
    CHECK_FALSE(takes(param, std::nextafter(high, 1e9)));
  }
  CHECK(takes(2, -1e300));
  CHECK_FALSE(takes(2, 0.67));
  const MonotonicClock clock;
  Job job(clock, 0, 0, 0, 0, "");
  CHECK_THROWS_AS(node->run(job), std::logic_error);
}

TEST_CASE("a parameter of a class that Takt does not have is refused by name") {
  Registry after;
  after.nodes.add<WithOwnParam>("with_own", Layer::processing, "");
  CHECK_THROWS_WITH_AS(plugin::describe(Registry{}, after), doctest::Contains("parameter own of with_own"),
                       std::invalid_argument);
}
