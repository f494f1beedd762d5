// SPDX-License-Identifier: Apache-2.0
#include "rt/assembly.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "rt/msg/odometry.hpp"
#include "tests/has.hpp"

namespace {

using namespace takt;
using test::has;

struct Counting final : Node {
  Output<Odometry> out{this, "out", "test data"};
  void setup(Setup&) override {}
  void run(Job& job) override {
    Odometry* const message = out.loan();
    message->x_m = static_cast<double>(job.index());
    out.send(job.release_ns());
  }
};

struct Noting final : Node {
  explicit Noting(double factor = 1) : factor(factor) {}
  Input<Odometry> in{this, "in", "test data"};
  double factor;
  std::vector<double> seen;
  bool finished = false;
  void setup(Setup&) override {}
  void run(Job&) override { seen.push_back(in.newest() != nullptr ? factor * in.newest()->x_m : -1); }
  void finish() override { finished = true; }
};

template <class Do>
std::string refusal(const Do& wrong) {
  try {
    wrong();
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "";
}

}  // namespace

TEST_CASE("an assembly runs its nodes by rate and by trigger, and finishes them") {
  Assembly assembly;
  auto& reader = assembly.add<Noting>("reader", {.rate = Rate{5, 1}, .offset_ns = 150'000'000});
  auto& triggered = assembly.add<Noting>("triggered", {}, 10.0);
  auto& source = assembly.add<Counting>("source", {.rate = Rate{10, 1}, .deadline_ns = 20'000'000});
  assembly.connect(source.out, reader.in);
  assembly.connect(source.out, triggered.in, {.triggers = true});
  assembly.run({.duration_ns = 500'000'000, .virtual_time = true});
  CHECK(reader.seen == std::vector<double>{1, 3});
  CHECK(triggered.seen == std::vector<double>{0, 10, 20, 30, 40});
  CHECK((reader.finished && triggered.finished));
}

TEST_CASE("an assembly is stopped by one of its nodes' jobs, in real time") {
  struct Stopping final : Node {
    explicit Stopping(Assembly& assembly) : assembly(&assembly) {}
    Assembly* assembly;
    int jobs = 0;
    void setup(Setup&) override {}
    void run(Job&) override {
      if (++jobs == 3) assembly->stop();
    }
  };
  Assembly assembly;
  auto& node = assembly.add<Stopping>("stopping", {.rate = Rate{100, 1}}, assembly);
  assembly.run();
  CHECK(node.jobs >= 3);
  CHECK_THROWS_AS(assembly.run(), std::logic_error);
}

TEST_CASE("what cannot be put together is refused with the names at fault") {
  Assembly assembly, other;
  auto& source = assembly.add<Counting>("source", {.rate = Rate{10, 1}});
  auto& paced = assembly.add<Noting>("paced", {.rate = Rate{10, 1}});
  auto& foreign = other.add<Noting>("foreign", {.rate = Rate{10, 1}});
  CHECK(has(refusal([&] { assembly.add<Counting>("source", {}); }), "two nodes `source`"));
  CHECK(has(refusal([&] { assembly.connect(source.out, foreign.in); }), "out -> in"));
  CHECK(has(refusal([&] { assembly.connect(source.out, paced.in, {.depth = 65}); }), "paced.in: depth is 65"));
  CHECK(has(refusal([&] { assembly.connect(source.out, paced.in, {.triggers = true}); }), "paced has a rate"));
  CHECK(has(refusal([&] { other.run(); }), "foreign.in must be connected"));
  Assembly still;
  still.add<Counting>("still", {});
  CHECK(has(refusal([&] { still.run(); }), "still has no rate"));
}
