// SPDX-License-Identifier: Apache-2.0
// Each way in which a condition holds, and in which it does not.
#include "graph/expect/condition_watch.hpp"

#include <doctest/doctest.h>

#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::graph;
using test::kMs;

namespace {

ConditionSpec at_least(double low, Holds holds = Holds::at_end) {
  ConditionSpec spec;
  spec.of = ConditionSpec::Of::field;
  spec.port = {"base", "odometry"};
  spec.field = "speed_m_s";
  spec.unit = "m/s";
  spec.bound.at_least = low;
  spec.holds = holds;
  return spec;
}

/// The condition after these values, one every 100 ms from 0 on.
ConditionWatch after(const ConditionSpec& spec, const std::vector<double>& values) {
  ConditionWatch watch(spec);
  int64_t at_ns = 0;
  for (const double value : values) {
    watch.see(value, at_ns);
    at_ns += 100 * kMs;
  }
  return watch;
}

}  // namespace

TEST_CASE("at the end: the newest value counts, since the last change") {
  const auto watch = after(at_least(1), {0, 1, 0, 1, 2});
  CHECK(watch.satisfied(0));
  CHECK(watch.must_come_true());
  const Finding finding = watch.finding();
  CHECK(finding.met);
  CHECK(finding.what == "base.odometry speed_m_s");
  CHECK(finding.expected == "at the end at least 1 m/s");
  CHECK(finding.observed == "2 m/s");
  CHECK(finding.since_s == doctest::Approx(0.3));
  CHECK_FALSE(after(at_least(1), {2, 0}).satisfied(0));
  CHECK_FALSE(after(at_least(1), {2, 0}).finding().since_s);
  CHECK_FALSE(after(at_least(1), {}).finding().met);
  CHECK(after(at_least(1), {}).finding().observed == "nothing");
}

TEST_CASE("once: has held at some time, since then") {
  const auto watch = after(at_least(1, Holds::once), {0, 3, 0});
  CHECK(watch.satisfied(0));
  CHECK(watch.finding().observed == "3 m/s");
  CHECK(watch.finding().since_s == doctest::Approx(0.1));
  CHECK_FALSE(after(at_least(1, Holds::once), {0, 0.5}).finding().met);
  CHECK(after(at_least(1, Holds::once), {0, 0.5}).finding().observed == "0.5 m/s");
}

TEST_CASE("always and never: one exception breaks them, silence proves nothing, and nobody waits for them") {
  CHECK(after(at_least(1, Holds::always), {1, 2}).finding().met);
  CHECK_FALSE(after(at_least(1, Holds::always), {1, 2}).must_come_true());
  const auto broken = after(at_least(1, Holds::always), {1, 0.5, 2});
  CHECK(broken.broken());
  CHECK_FALSE(broken.finding().met);
  CHECK(broken.finding().observed == "0.5 m/s");
  CHECK(broken.finding().since_s == doctest::Approx(0.1));
  CHECK(after(at_least(1, Holds::never), {0, 0.9}).finding().met);
  CHECK(after(at_least(1, Holds::never), {0, 1}).broken());
  for (const Holds holds : {Holds::always, Holds::never}) {
    CHECK_FALSE(after(at_least(1, holds), {}).finding().met);
    CHECK_FALSE(after(at_least(1, holds), {}).satisfied(0));
  }
}

TEST_CASE("a window: what is outside does not count, and its end is waited for") {
  ConditionSpec spec = at_least(1, Holds::always);
  spec.from_ns = 100 * kMs;
  spec.to_ns = 300 * kMs;
  const auto watch = after(spec, {0, 1, 1, 0});
  CHECK(watch.finding().met);
  CHECK(watch.must_come_true());
  CHECK_FALSE(watch.satisfied(299 * kMs));
  CHECK(watch.satisfied(300 * kMs));
  CHECK(watch.finding().expected == "always at least 1 m/s from 0.1 s to 0.3 s");
  CHECK(after(spec, {0, 1, 0, 1}).broken());
  CHECK_FALSE(after(spec, {1}).satisfied(400 * kMs));
}

TEST_CASE("messages: their number, in the window") {
  ConditionSpec spec;
  spec.of = ConditionSpec::Of::messages;
  spec.port = {"stereo", "disparity"};
  spec.bound.at_least = 3;
  const auto count = [&](size_t messages) {
    ConditionWatch watch(spec);
    for (size_t i = 0; i < messages; ++i) watch.see(std::nullopt, static_cast<int64_t>(i) * 100 * kMs);
    return watch;
  };
  CHECK_FALSE(count(2).finding().met);
  CHECK(count(3).finding().met);
  CHECK(count(3).finding().since_s == doctest::Approx(0.2));
  CHECK(count(3).finding().what == "messages of stereo.disparity");
  CHECK(count(5).finding().observed == "5");
  spec.bound = {std::nullopt, 0.0};
  CHECK(count(0).finding().met);
  CHECK(count(0).finding().observed == "0");
  CHECK_FALSE(count(1).finding().met);
  spec.from_ns = 100 * kMs;
  CHECK(count(1).finding().met);
  CHECK_FALSE(count(2).finding().met);
}

TEST_CASE("texts: what they are, what they contain; a number is none") {
  ConditionSpec spec;
  spec.of = ConditionSpec::Of::attribute;
  spec.object = "cup";
  spec.attribute = "content";
  spec.is = "full";
  ConditionWatch watch(spec);
  watch.see(std::nullopt, 0);
  CHECK_FALSE(watch.finding().met);
  CHECK(watch.finding().observed == "nothing");
  watch.see("empty", kMs);
  CHECK_FALSE(watch.satisfied(kMs));
  watch.see("full", 2 * kMs);
  CHECK(watch.satisfied(2 * kMs));
  CHECK(watch.finding().what == "cup.content");
  CHECK(watch.finding().expected == "at the end is \"full\"");
  CHECK(watch.finding().observed == "\"full\"");
  watch.see(1.0, 3 * kMs);
  CHECK_FALSE(watch.finding().met);
  spec.is.reset();
  spec.contains = "done";
  ConditionWatch part(spec);
  part.see("IDLE: done", 0);
  CHECK(part.finding().met);
  part.see(std::string(100, 'x'), 0);
  CHECK(part.finding().observed == "\"" + std::string(60, 'x') + "...\"");
}
