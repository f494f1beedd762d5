// SPDX-License-Identifier: Apache-2.0
// A device node whose device goes and comes back, job by job.
#include <doctest/doctest.h>

#include <functional>
#include <vector>

#include "hal/gpio/lines_node.hpp"
#include "hal/laser/laser_node.hpp"
#include "tests/conformance/fake_writer.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;

namespace {

using test::kMs;
constexpr int64_t kPeriod = 50 * kMs;

/// There from `there_ms` on; a read says what `status` does.
class Lines final : public DigitalLines {
 public:
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t now_ns) override {
    ++starts;
    if (now_ns >= there_ns) return {};
    return device_failure("lines", "not there", "plug it in");
  }
  void stop() override { ++stops; }
  uint32_t count() const override { return 1; }
  LinesReading read(int64_t wanted_ns) override {
    ++reads;
    return {status(wanted_ns), wanted_ns, 1, 0};
  }
  bool write(uint32_t, bool, int64_t) override { return false; }

  int64_t there_ns = 0;
  std::function<ReadStatus(int64_t)> status = [](int64_t) { return ReadStatus::ok; };
  int starts = 0, stops = 0, reads = 0;
};

struct LinesFixture {
  Lines* lines = new Lines;  // owned by the node
  LinesNode node{std::unique_ptr<DigitalLines>(lines)};
  test::FakeWriter writer{*node.outputs()[0]};
  VirtualClock clock;
  int64_t next = 0;
  std::optional<SourceReport> report;
  bool result = false;

  LinesFixture() {
    Setup setup{clock, ".", {}, 1, Rate{20, 1}};
    node.setup(setup);
  }
  /// Runs jobs up to that release, without it.
  void run_to(int64_t end_ms) {
    for (; next * kPeriod < end_ms * kMs; ++next) {
      PortAccess::reset(*node.outputs()[0]);
      Job job(clock, static_cast<uint64_t>(next), next * kPeriod, (next + 1) * kPeriod, 0, "full");
      node.run(job);
      report = job.source_report();
      result = !job.without_result();
      CHECK(result == PortAccess::sent(*node.outputs()[0]));
    }
  }
};

}  // namespace

TEST_CASE("a device that is not there at the start is tried with growing pauses, and told as lost") {
  LinesFixture f;
  f.lines->there_ns = 2000 * kMs;
  f.node.start(0);
  f.run_to(2000);  // tried at 0, 100, 300, 700 and 1500 ms
  CHECK(f.lines->starts == 1 + 5);
  CHECK(f.lines->reads == 0);
  CHECK_FALSE(f.result);
  REQUIRE(f.report);
  CHECK(f.report->state == SourceState::disconnected);
  CHECK(f.report->reopen_tries == 5);
  f.run_to(2500);
  CHECK(f.lines->reads == 0);
  f.run_to(2550);  // the sixth, 1 s after the fifth
  CHECK(f.result);
  CHECK(f.report->state == SourceState::disconnected);
  f.run_to(3000);
  CHECK(f.report->state == SourceState::disconnected);
  f.run_to(3050);
  CHECK(f.report->state == SourceState::ok);
  CHECK(f.report->reopen_tries == 6);
}

TEST_CASE("a device that says it is gone is restarted by the jobs, not read meanwhile") {
  LinesFixture f;
  f.node.start(0);
  f.run_to(1000);
  CHECK(f.report->state == SourceState::ok);
  f.lines->status = [](int64_t) { return ReadStatus::disconnected; };
  f.lines->there_ns = 1250 * kMs;
  f.run_to(1050);
  CHECK(f.report->state == SourceState::disconnected);
  const int reads = f.lines->reads;
  f.run_to(1700);  // tried at 1100 and 1300: then it is there, and says again that it is gone
  CHECK(f.report->reopen_tries == 2);
  CHECK(f.lines->reads == reads + 1);
  f.lines->status = [](int64_t) { return ReadStatus::ok; };
  f.run_to(2200);  // tried at 1700
  CHECK(f.report->state == SourceState::disconnected);
  f.run_to(2250);
  CHECK(f.report->state == SourceState::ok);
  CHECK(f.report->reopen_tries == 3);
}

TEST_CASE("a device that comes for one read and goes again is not tried more often for it") {
  LinesFixture f;
  f.node.start(0);
  bool there = false;
  f.lines->status = [&](int64_t) { return (there = !there) ? ReadStatus::ok : ReadStatus::disconnected; };
  f.run_to(20'000);
  CHECK(f.report->reopen_tries == 4 + 18);  // with growing pauses until 1.6 s, then each second
  CHECK(f.report->state == SourceState::disconnected);
}

TEST_CASE("silence, damage and the settings of the graph decide the state; damaged small data are not sent") {
  for (const auto& [status, state] :
       {std::pair{ReadStatus::no_data, SourceState::silent}, std::pair{ReadStatus::partial, SourceState::garbage}}) {
    LinesFixture f;
    f.node.set_health({100 * kMs, 200 * kMs, true});
    Setup setup{f.clock, ".", {}, 1, Rate{20, 1}};
    f.node.setup(setup);
    f.node.start(0);
    f.run_to(250);
    REQUIRE(f.report);
    CHECK(f.report->state == SourceState::ok);
    f.lines->status = [&, bad = status](int64_t) { return bad; };
    f.run_to(300);
    CHECK_FALSE(f.result);
    CHECK(f.report->state == SourceState::ok);
    f.run_to(350);
    CHECK(f.report->state == state);
    CHECK(f.report->reopen_tries == 0);
    f.lines->status = [](int64_t) { return ReadStatus::ok; };
    f.run_to(400);
    CHECK(f.result);  // the data are used at once, the state waits
    CHECK(f.report->state == state);
    f.run_to(600);
    CHECK(f.report->state == SourceState::ok);
  }
}
