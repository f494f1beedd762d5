// SPDX-License-Identifier: Apache-2.0
// Who outside hears of a run: the rule, and what the sinks are told over time.
#include "rt/supervise/outward_watchdog.hpp"

#include <doctest/doctest.h>

#include <cerrno>
#include <vector>

#include "rt/node.hpp"
#include "rt/supervise/watchdog_device.hpp"
#include "tests/unit/rt/epoch.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using test::Idle, test::kEpoch, test::kMs;

struct Listener final : WatchdogSink {
  explicit Listener(int64_t timeout) : timeout_(timeout) {}
  int64_t timeout_ns() const override { return timeout_; }
  void ready() override { ++readies; }
  void feed() override { fed_ms.push_back(now_ms); }
  void status(const std::string& text) override { statuses.push_back(text); }
  void end() override { ended = true; }
  int64_t timeout_, now_ms = 0;
  int readies = 0;
  bool ended = false;
  std::vector<int64_t> fed_ms;
  std::vector<std::string> statuses;
};

/// One high and one low task at 10 Hz with deadlines of 100 ms, and a mode without the high one. Patience is 300 ms.
struct WatchdogScene {
  Idle high, low;
  Plan plan;
  RunBoard board{make()};
  Listener listener{400 * kMs}, slow{1000 * kMs};
  OutwardWatchdog watchdog{plan, board, {&listener, &slow}};
  int64_t now_ms = 0;
  bool high_works = true;

  const Plan& make() {
    test::add_task(plan, high, "high", 0);
    test::add_task(plan, low, "low", 0);
    plan.tasks[0].criticality = Criticality::high;
    plan.modes = {{"full", {1, 1}}, {"rest", {0, 1}}};
    return plan;
  }
  void begin() { board.epoch_ns().store(kEpoch); }
  /// Ticks every 50 ms up to that instant after the epoch, with a job every 100 ms.
  void to(int64_t end_ms) {
    for (; now_ms < end_ms; now_ms += 50) {
      if (now_ms % 100 == 0 && high_works) ++board.task(0).completed;
      listener.now_ms = slow.now_ms = now_ms;
      watchdog.tick(kEpoch + now_ms * kMs);
    }
  }
  size_t feeds() const { return listener.fed_ms.size(); }
};

/// Notes what is asked of the kernel; each call answers with its error.
struct PortDouble final : WatchdogPort {
  struct Calls {
    std::vector<std::string> made;
    int open_error = 0, timeout_error = 0, granted_s = 0;
  };
  explicit PortDouble(Calls& calls) : calls(calls) {}
  int open(const std::filesystem::path& file) override {
    calls.made.push_back("open " + file.string());
    return calls.open_error;
  }
  int set_timeout(int& seconds) override {
    calls.made.push_back("timeout " + std::to_string(seconds));
    if (calls.granted_s != 0) seconds = calls.granted_s;
    return calls.timeout_error;
  }
  int keep_alive() override { return calls.made.push_back("feed"), 0; }
  int write_magic_close() override { return calls.made.push_back("V"), 0; }
  void close() override { calls.made.push_back("close"); }
  Calls& calls;
};

std::string refusal(PortDouble::Calls& calls) {
  try {
    WatchdogDevice("/dev/watchdog7", 10, std::make_unique<PortDouble>(calls));
  } catch (const WatchdogRefused& refused) {
    return refused.what();
  }
  return "";
}

}  // namespace

TEST_CASE("may be fed: every high node that the mode lets run met its deadlines and got further") {
  const FedTask well{true, 0, 300, 300}, missed{true, 1, 0, 300}, stands{true, 0, 301, 300};
  const auto at_rest = [](FedTask task) { return task.runs = false, task; };
  using Tasks = std::vector<FedTask>;
  CHECK_FALSE(forbids_feeding(Tasks{}));
  CHECK_FALSE(forbids_feeding(Tasks{well, well}));
  CHECK(forbids_feeding(Tasks{well, missed}) == 1);
  CHECK(forbids_feeding(Tasks{stands, missed}) == 0);
  CHECK_FALSE(forbids_feeding(Tasks{at_rest(missed), at_rest(stands), well}));
  CHECK_FALSE(forbids_feeding(Tasks{FedTask{true, 0, 1'000'000, 0}}));  // no rate that it would have to keep
}

TEST_CASE("fed at half of the shortest timeout while all is well; ready once, with the epoch") {
  WatchdogScene scene;
  CHECK(scene.watchdog.interval_ns() == 200 * kMs);
  scene.to(100);  // the start is still to come: fed, but not ready
  CHECK(scene.listener.readies == 0);
  scene.begin();
  scene.to(1000);
  CHECK(scene.listener.readies == 1);
  CHECK(scene.listener.fed_ms == std::vector<int64_t>{0, 200, 400, 600, 800});
  CHECK(scene.slow.fed_ms == scene.listener.fed_ms);
  CHECK(scene.listener.statuses == std::vector<std::string>{"mode full"});
  scene.watchdog.end();
  CHECK(scene.listener.ended);
  CHECK(scene.slow.ended);
}

TEST_CASE("a deadline that a high node misses ends the feeding for good, one of a low node does not") {
  WatchdogScene scene;
  scene.begin();
  scene.to(500);
  ++scene.board.task(1).deadline_misses;
  scene.to(1000);
  CHECK(scene.feeds() == 5);
  ++scene.board.task(0).deadline_misses;
  scene.to(5000);
  CHECK(scene.feeds() == 5);
  CHECK(scene.listener.statuses.back() == "mode full; not fed: high missed a deadline");
}

TEST_CASE("a high node that gets no further is not fed for, and is again once it does") {
  WatchdogScene scene;
  scene.begin();
  scene.to(1000);
  scene.high_works = false;
  scene.to(3000);
  CHECK(scene.listener.fed_ms.back() == 1200);  // its last job ended at 900, patience 300 ms
  CHECK(scene.listener.statuses.back() == "mode full; not fed: high gets no further");
  scene.high_works = true;
  scene.to(3500);
  CHECK(scene.listener.fed_ms.back() > 3000);
}

TEST_CASE("what the mode leaves out need not get further; a lost source stands in the status") {
  WatchdogScene scene;
  scene.begin();
  scene.to(500);
  scene.high_works = false;
  scene.board.modes().request(1, kEpoch + 500 * kMs, "a person");
  scene.board.tell_source(1, 0, {SourceState::silent, 0}, kEpoch, kEpoch);
  scene.to(3000);
  CHECK(scene.feeds() == 15);
  CHECK(scene.listener.statuses.back() == "mode rest; low silent");
}

TEST_CASE("after the end of the run its last jobs are not judged") {
  WatchdogScene scene;
  scene.begin();
  scene.board.stop().set_planned_end(kEpoch + 1000 * kMs);
  scene.to(1000);
  scene.high_works = false;
  scene.to(3000);
  CHECK(scene.feeds() == 15);
  WatchdogScene missed;
  missed.begin();
  missed.board.stop().set_planned_end(kEpoch + 1000 * kMs);
  missed.to(500);
  ++missed.board.task(0).deadline_misses;
  missed.to(3000);
  CHECK(missed.feeds() == 3);  // the end makes nothing good
}

TEST_CASE("who only listens asks for no feed") {
  WatchdogScene scene;
  Listener listener{0};
  OutwardWatchdog watchdog{scene.plan, scene.board, {&listener}};
  CHECK(watchdog.interval_ns() == 0);
  scene.begin();
  watchdog.tick(kEpoch);
  watchdog.tick(kEpoch + 5000 * kMs);
  CHECK(listener.readies == 1);
  CHECK(listener.fed_ms.empty());
}

TEST_CASE("watchdog device: armed, fed, and disarmed only by an end in order") {
  PortDouble::Calls calls;
  calls.granted_s = 8;
  {
    WatchdogDevice device("/dev/watchdog7", 10, std::make_unique<PortDouble>(calls));
    CHECK(device.timeout_ns() == 8000 * kMs);
    device.feed();
    device.end();
  }
  CHECK(calls.made == std::vector<std::string>{"open /dev/watchdog7", "timeout 10", "feed", "V", "close"});
  calls.made.clear();
  { const WatchdogDevice device("/dev/watchdog7", 10, std::make_unique<PortDouble>(calls)); }
  CHECK(calls.made == std::vector<std::string>{"open /dev/watchdog7", "timeout 10", "close"});
}

TEST_CASE("watchdog device: what is refused is told with the file and the fix, and does not stay armed") {
  PortDouble::Calls calls;
  calls.open_error = EBUSY;
  CHECK(refusal(calls).find("/dev/watchdog7: cannot be opened: Device or resource busy; fix: somebody else holds it") !=
        std::string::npos);
  calls = {};
  calls.timeout_error = ENOTTY;
  CHECK(refusal(calls).find("takes no timeout") != std::string::npos);
  CHECK(calls.made == std::vector<std::string>{"open /dev/watchdog7", "timeout 10", "V", "close"});
  try {
    WatchdogDevice("/nowhere/watchdog", 10, kernel_watchdog_port());
    FAIL("opened");
  } catch (const WatchdogRefused& refused) {
    CHECK(std::string(refused.what()).find("/nowhere/watchdog: cannot be opened: No such file") != std::string::npos);
  }
}
