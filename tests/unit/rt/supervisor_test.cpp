// SPDX-License-Identifier: Apache-2.0
// Who died, hangs or is back, as the supervisor sees it: real processes that do nothing, a clock and a board that say
// what they would have done.
#include "rt/supervise/supervisor.hpp"

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>

#include "tests/nanoseconds.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using test::Idle, test::kMs;
constexpr int64_t kBegin = 1000 * kMs;

/// Reads, and does nothing.
struct Reading final : Node {
  Input<Odometry> in{this, "in", ""};
  Output<Odometry> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

/// Two processes with a task each, of which the first is of high criticality and reads the other one's output.
struct SupervisorScene {
  Reading first;
  Idle second;
  Plan plan;
  VirtualClock clock{kBegin};
  ProcessGroup group;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Supervisor> supervisor;
  std::vector<std::string> said;
  std::vector<pid_t> cleaned;

  explicit SupervisorScene(const RestartPolicy::Limits& limits = {}, bool spares = false) {
    test::add_task(plan, first, "first", 0);
    test::add_task(plan, second, "second", 0);
    plan.tasks[0].edges.push_back({0, 1, 1, 0});
    plan.tasks[0].criticality = Criticality::high;
    plan.modes = {{"full", {1, 1}}, {"safe_stop", {1, 0}}};
    plan.safe_stop = 1;
    board = std::make_unique<RunBoard>(plan, 2);
    const auto endless = [] {
      for (;;) pause();
      return 0;
    };
    for (const char* name : {"one", "two"}) group.start(name, endless, endless);
    group.prepare_restarts();
    transport = make_local_transport(plan.ports);
    Supervisor::Options options;
    options.restarts = limits;
    options.silence_ns = 1000 * kMs;
    options.start_patience_ns = 5000 * kMs;
    options.spares = {spares, false};
    options.spare_delay_ns = 200 * kMs;
    options.spare_patience_ns = 30'000 * kMs;
    options.poison_ns = 0;  // beside the silence
    options.clean_up = [this](pid_t pid) { cleaned.push_back(pid); };
    options.say = [this](const std::string& what) { said.push_back(what); };
    supervisor = std::make_unique<Supervisor>(plan, *board, group, *transport, clock,
                                              std::vector<std::vector<size_t>>{{0}, {1}}, options);
  }
  void to(int64_t ms) {
    clock.advance_to(kBegin + ms * kMs);
    supervisor->look();
  }
  /// Looks after the death that has just been caused.
  void bury(pid_t pid) {
    siginfo_t ended;
    while (waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT) != 0) REQUIRE(errno == EINTR);
    supervisor->look();
  }
  void kill_one(int signal = SIGKILL) {
    const pid_t pid = group.pid(0);
    REQUIRE(pid > 0);
    kill(pid, signal);
    bury(pid);
  }
  /// The first process ends in a job that has messages `from` to `to` in hand, none of which a job before had.
  void crash_on(uint64_t from, uint64_t to, int signal = SIGUSR1) {
    board->task(0).in_job.store(7);
    board->edge(0, 0).last_seen = from - 1;
    board->edge(0, 0).in_hand.store(to);
    kill_one(signal);
    CHECK(board->task(0).in_job.load() == 0);
  }
  /// It is back at that instant.
  void back_at(int64_t ms) {
    board->process(0).reach(ProcessRecord::running, kBegin + ms * kMs);
    board->task(0).job_count.fetch_add(1);
    to(ms);
  }
  EdgeStatistics& edge() { return board->edge(0, 0); }
  /// The first process is at work again, and has run a job.
  void come_back() {
    board->process(0).state.store(ProcessRecord::running);
    board->task(0).job_count.fetch_add(1);
  }
  const Outage& outage(size_t i = 0) { return board->outages()[i]; }
  bool told(const char* text) const { return !said.empty() && said.back().find(text) != std::string::npos; }
};

}  // namespace

TEST_CASE("one that dies is noted, cleared up after and started again at once; back when its tasks have run") {
  SupervisorScene scene;
  const pid_t dead = scene.group.pid(0), other = scene.group.pid(1);
  scene.to(20'000);
  scene.kill_one();
  REQUIRE(scene.board->outages().size() == 1);
  CHECK(scene.outage().process == 0);
  CHECK(scene.outage().from_ns == kBegin + 20'000 * kMs);
  CHECK(std::string(scene.outage().cause.text()) == "was ended by signal 9 (Killed)");
  CHECK(scene.cleaned == std::vector<pid_t>{dead});
  CHECK(scene.outage().started);
  CHECK(scene.group.pid(0) > 0);
  CHECK(scene.group.pid(0) != dead);
  CHECK(scene.board->process(0).restarts.load() == 1);
  scene.to(20'100);
  CHECK(scene.outage().back_ns == 0);
  scene.board->process(0).state.store(ProcessRecord::running);
  scene.to(20'200);
  CHECK(scene.outage().back_ns == 0);  // no job yet
  scene.come_back();
  scene.to(20'300);
  CHECK(scene.outage().back_ns == kBegin + 20'300 * kMs);
  CHECK(scene.told("process one is back after 0.30 s"));
  CHECK(scene.group.pid(1) == other);
  CHECK_FALSE(scene.supervisor->gave_up());
}

TEST_CASE("one that gives no sign of life is ended, while one whose watchdog speaks is not") {
  SupervisorScene scene;
  for (int64_t ms = 10; ms <= 1500; ms += 10) {
    scene.board->process(0).life.heartbeat_ns.store(kBegin + 10 * kMs);
    scene.board->process(1).life.heartbeat_ns.store(kBegin + ms * kMs);
    const pid_t before = scene.group.pid(0);
    scene.to(ms);
    if (ms > 1010) scene.bury(before);
    if (scene.board->outages().size() > 0) break;
  }
  REQUIRE(scene.board->outages().size() == 1);
  CHECK(scene.outage().process == 0);
  CHECK(scene.outage().from_ns == kBegin + 10 * kMs);  // away since it was last heard
  CHECK(std::string(scene.outage().cause.text()).find("gave no sign of life for 1.00 s") != std::string::npos);
}

TEST_CASE("a job that does not return costs its process a restart") {
  SupervisorScene scene;
  scene.board->process(0).life.hanging_since_ns.store(kBegin + 5 * kMs);
  scene.board->process(0).life.hanging.store(1);
  const pid_t hung = scene.group.pid(0);
  scene.to(1200);
  scene.bury(hung);
  REQUIRE(scene.board->outages().size() == 1);
  CHECK(scene.outage().from_ns == kBegin + 5 * kMs);
  CHECK(std::string(scene.outage().cause.text()).find("a job of first did not return") != std::string::npos);
  CHECK(scene.board->process(0).life.hanging.load() == 0);  // its successor does not hang
}

TEST_CASE("one that stands still on its way back is ended after the silence, one that is not back after the patience") {
  SupervisorScene scene;
  scene.to(20'000);
  scene.kill_one();
  const pid_t second = scene.group.pid(0);
  int64_t ms = 20'000;
  const auto until_ended = [&](const auto& sign) {
    const size_t before = scene.cleaned.size();
    // The process is a real one: once it is ended, its death may take longer than many looks.
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (scene.cleaned.size() == before && std::chrono::steady_clock::now() < patience) {
      sign();
      const pid_t pid = scene.group.pid(0);
      scene.to(ms += 50);
      siginfo_t ended;
      if (kill(pid, 0) == 0 && waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT | WNOHANG) == 0 &&
          ended.si_pid == pid)
        scene.bury(pid);
    }
  };
  SUBCASE("stands still") {
    kill(second, SIGSTOP);
    siginfo_t stopped;  // until then it may use CPU time yet, which is a sign of life
    while (waitid(P_PID, static_cast<id_t>(second), &stopped, WSTOPPED | WNOWAIT) != 0) REQUIRE(errno == EINTR);
    until_ended([] {});
    // However late its death is seen, it was ended long before the patience was over.
    CHECK(std::string(scene.outage().cause.text()) == "was ended by signal 9 (Killed)");
    CHECK(scene.told("stood still on its way back for 1.00 s"));
  }
  SUBCASE("is busy with something else") {
    until_ended([&] { scene.board->process(0).life.heartbeat_ns.store(kBegin + ms * kMs); });
    CHECK(ms >= 25'000);
    CHECK(scene.told("did not come back within 5.00 s"));
  }
  CHECK(scene.board->outages().size() == 1);  // the outage goes on
  CHECK(scene.outage().back_ns == 0);
}

TEST_CASE("one that dies too often is given up, and with high criticality that is a safe stop") {
  SupervisorScene scene({.step_ns = 0, .most_in_window = 3});
  for (int64_t i = 1; i <= 3; ++i) {
    CHECK(scene.board->modes().newest() == 0);
    scene.to(i * 100);
    scene.kill_one();
    scene.to(i * 100 + 50);
  }
  CHECK(scene.supervisor->gave_up());
  CHECK(scene.group.pid(0) == 0);
  CHECK(scene.outage().start_ns == 0);
  CHECK(scene.board->modes().newest() == 1);
  CHECK(scene.told("for the 3th time"));
}

TEST_CASE("an end in order is no outage, one before the run's end is; at the end nobody is started again") {
  SupervisorScene scene;
  scene.board->process(1).state.store(ProcessRecord::finished);
  scene.to(1000);
  CHECK(scene.board->outages().size() == 0);
  scene.supervisor->let_end();
  scene.kill_one();
  CHECK(scene.board->outages().size() == 1);
  CHECK(scene.group.pid(0) == 0);
  CHECK(scene.outage().start_ns == 0);
  CHECK_FALSE(scene.supervisor->gave_up());
}

TEST_CASE("after the loss of a whole group every process counts as away, one that was away already only once") {
  SupervisorScene scene;
  Outage before;
  before.process = 1;
  before.from_ns = kBegin;
  before.cause = BoundedText<200>("was ended by signal 9 (Killed)");
  scene.board->outages().add(before);
  GroupSigns::Loss loss;
  loss.from_ns = kBegin + 500 * kMs;
  loss.cause = BoundedText<200>("the daemon is gone");
  scene.clock.advance_to(kBegin + 600 * kMs);
  scene.supervisor->all_were_lost(loss);
  REQUIRE(scene.board->outages().size() == 2);
  CHECK(std::string(scene.outage(0).cause.text()) == "was ended by signal 9 (Killed); then the daemon is gone");
  CHECK(scene.outage(1).process == 0);
  for (size_t p = 0; p < 2; ++p) {
    scene.board->process(p).state.store(ProcessRecord::running);
    scene.board->task(p).job_count.fetch_add(1);
  }
  scene.to(700);
  for (size_t i = 0; i < 2; ++i) CHECK(scene.outage(i).back_ns == kBegin + 700 * kMs);
}

TEST_CASE("a full log of outages keeps those that last apart, and the newest of those that are over") {
  auto log = std::make_unique<OutageLog>();
  const auto add = [&](uint32_t process, int64_t from_ns, int64_t back_ns) {
    Outage outage;
    outage.process = process;
    outage.from_ns = from_ns;
    outage.back_ns = back_ns;
    return log->add(outage);
  };
  const size_t lasting = add(7, 0, 0);
  for (size_t i = 1; i < OutageLog::kMost; ++i) add(0, static_cast<int64_t>(i), static_cast<int64_t>(i) + 1);
  CHECK(log->lost() == 0);
  const size_t one = add(1, 10'000, 0), two = add(2, 10'001, 0);
  CHECK(one != two);
  CHECK(one != lasting);
  CHECK(log->lost() == 2);
  CHECK((*log)[lasting].process == 7);
  const std::vector<Outage> all = log->in_order();
  REQUIRE(all.size() == OutageLog::kMost);
  CHECK(all[0].process == 7);
  CHECK(all[1].from_ns == 3);  // the oldest two that were over made room
  CHECK(all[all.size() - 2].process == 1);
  CHECK(all.back().process == 2);
}

TEST_CASE("a spare is forked once the run is up, takes over at once where it is ready, and another one follows") {
  SupervisorScene scene({}, true);
  scene.to(100);
  CHECK(scene.group.spare(0) == 0);
  scene.to(200);
  const pid_t spare = scene.group.spare(0);
  REQUIRE(spare > 0);
  CHECK(scene.group.spare(1) == 0);
  scene.board->spare(0).ready.store(spare);
  scene.to(300);
  CHECK(scene.supervisor->spare_use(0).ready);
  CHECK(scene.supervisor->spare_use(0).ready_within_ns == 100 * kMs);
  scene.to(1000);
  scene.kill_one();
  CHECK(scene.group.pid(0) == spare);
  CHECK(scene.board->spare_order(0).takes_over.load() == spare);
  REQUIRE(scene.board->outages().size() == 1);
  CHECK(scene.outage().by_spare);
  CHECK(scene.board->process(0).restarts.load() == 1);
  scene.to(1100);
  CHECK(scene.group.spare(0) == 0);  // not before it is back
  scene.back_at(1200);
  scene.to(1300);
  CHECK(scene.group.spare(0) == 0);
  scene.to(1400);
  const pid_t second = scene.group.spare(0);
  REQUIRE(second > 0);
  CHECK(scene.board->spare_order(0).takes_over.load() == 0);
  CHECK(scene.supervisor->spare_use(0).takeovers == 1);
  scene.board->spare(0).ready.store(second);
  scene.to(1500);
  scene.kill_one();  // without a spare it would have to wait
  CHECK(scene.group.pid(0) == second);
  CHECK(scene.supervisor->spare_use(0).lost == 0);
}

TEST_CASE("without a ready spare a process comes back the ordinary way, which is counted") {
  SupervisorScene scene({}, true);
  scene.to(20'000);
  const pid_t spare = scene.group.spare(0);
  REQUIRE(spare > 0);
  scene.kill_one();
  CHECK(scene.group.pid(0) > 0);
  CHECK(scene.group.pid(0) != spare);
  CHECK_FALSE(scene.outage().by_spare);
  CHECK(scene.supervisor->spare_use(0).not_ready == 1);
  CHECK(scene.supervisor->spare_use(0).takeovers == 0);
}

TEST_CASE("a spare that dies is replaced and counted, one that does not become ready in time is ended") {
  SupervisorScene scene({}, true);
  scene.to(200);
  const pid_t first = scene.group.spare(0);
  REQUIRE(first > 0);
  kill(first, SIGKILL);
  scene.bury(first);
  CHECK(scene.board->outages().size() == 0);
  CHECK(scene.supervisor->spare_use(0).lost == 1);
  CHECK(scene.told("the spare of process one was ended by signal 9"));
  scene.to(201);
  const pid_t second = scene.group.spare(0);
  REQUIRE(second > 0);
  CHECK(second != first);
  scene.clock.advance_to(kBegin + 100'000 * kMs);
  scene.supervisor->look();
  scene.bury(second);
  CHECK(scene.supervisor->spare_use(0).lost == 2);
}

TEST_CASE("a message on which a process ends twice within a second is passed over; the next one is a safe stop") {
  SupervisorScene scene;
  scene.to(20'000);
  scene.crash_on(5, 6);
  CHECK(scene.edge().pass_over_to.load() == 0);
  scene.back_at(20'100);
  int64_t second_ms = 21'000;
  SUBCASE("later than that it is by chance") { second_ms = 21'200; }
  SUBCASE("on another message it is by chance") { scene.edge().last_seen = 6; }
  SUBCASE("a kill says nothing of a message") {
    scene.to(second_ms);
    scene.crash_on(5, 5, SIGKILL);
    CHECK(scene.edge().passed_over.load() == 0);
    return;
  }
  SUBCASE("once more") {
    scene.to(second_ms);
    scene.crash_on(5, 5);
    CHECK(scene.edge().pass_over_from.load() == 5);
    CHECK(scene.edge().pass_over_to.load() == 5);
    CHECK(scene.edge().passed_over.load() == 1);
    REQUIRE(scene.board->faults().size() == 1);
    CHECK(std::string(scene.board->faults().at(0)->what.text()) ==
          "first.in: process one ended twice on message 5 of second., which it does not get again");
    CHECK(scene.board->modes().newest() == 0);
    scene.to(21'100);
    scene.back_at(21'200);
    scene.crash_on(5, 6);
    CHECK(scene.board->modes().newest() == 1);
    CHECK(scene.edge().passed_over.load() == 1);
    return;
  }
  scene.to(second_ms);
  scene.crash_on(scene.edge().last_seen + 1, 7);
  CHECK(scene.edge().passed_over.load() == 0);
  CHECK(scene.board->modes().newest() == 0);
}
