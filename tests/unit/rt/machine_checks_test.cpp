// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <linux/capability.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>

#include "rt/machine/checks.hpp"
#include "rt/machine/child.hpp"
#include "tests/unit/rt/fake_facts.hpp"

using namespace takt;
using namespace takt::machine;
using takt::test::FakeFacts;

namespace {

bool has_fix(const Finding& finding, const std::string& words) {
  return std::any_of(finding.fixes.begin(), finding.fixes.end(),
                     [&](const Fix& fix) { return (fix.where + ": " + fix.text).find(words) != std::string::npos; });
}
bool says(const Finding& finding, const std::string& words) { return finding.found.find(words) != std::string::npos; }

using Files = std::map<std::string, std::string>;

/// Writes files and tells what a check finds then.
Finding after(FakeFacts& facts, const Files& files, Finding (*check)(const Facts&)) {
  facts.write(files);
  return check(facts);
}

PolicyTrial refused(int error) {
  PolicyTrial trial;
  trial.answered = true;
  trial.error = error;
  return trial;
}

}  // namespace

TEST_CASE("SCHED_DEADLINE: granted, refused for each of the reasons, no answer") {
  FakeFacts facts;
  PolicyTrial granted;
  granted.answered = granted.verified = true;
  granted.runtime_ns = 1'000'000;
  granted.period_ns = 10'000'000;
  CHECK(check_sched_deadline(facts, granted).status == Status::ok);
  CHECK(says(check_sched_deadline(facts, granted), "1 ms every 10 ms"));
  granted.verified = false;
  CHECK(check_sched_deadline(facts, granted).status == Status::warn);

  const Finding no_right = check_sched_deadline(facts, refused(EPERM));
  CHECK(no_right.status == Status::lacks);
  CHECK(has_fix(no_right, "setcap cap_sys_nice,cap_ipc_lock+ep /opt/takt"));
  CHECK(has_fix(no_right, "chmod 0750 /opt/takt"));
  CHECK(has_fix(no_right, "AmbientCapabilities"));
  CHECK(has_fix(check_sched_deadline(facts, refused(EBUSY)), "sched_rt_runtime_us"));
  facts.cpus = {1};
  const Finding pinned = check_sched_deadline(facts, refused(EPERM));
  CHECK(says(pinned, "only CPUs 1 of 0-1"));
  CHECK(has_fix(pinned, "taskset"));
  CHECK(check_sched_deadline(facts, {}).status == Status::unknown);
}

TEST_CASE("bandwidth: who holds it, and what nobody holds") {
  machine::BandwidthTrial trial;
  CHECK(check_deadline_bandwidth(trial).status == Status::unknown);
  trial.answered = true;
  CHECK(says(check_deadline_bandwidth(trial), "refused"));
  trial.granted = true;
  trial.limit = 1.8;
  trial.free = 1.05;
  std::strcpy(trial.holders.data(), "takt (pid 12, 9 threads) 0.750");
  CHECK(check_deadline_bandwidth(trial).status == Status::ok);
  CHECK(says(check_deadline_bandwidth(trial), "1.050 of 1.800 cores free; held by takt (pid 12"));
  trial.lost = 0.1;
  std::strcpy(trial.recount.data(), "sudo sysctl kernel.sched_rt_runtime_us=950000");
  CHECK(check_deadline_bandwidth(trial).status == Status::warn);
  CHECK(says(check_deadline_bandwidth(trial), "0.100 lost"));
  CHECK(has_fix(check_deadline_bandwidth(trial), "sched_rt_runtime_us=950000"));
}

TEST_CASE("SCHED_FIFO: a control group without a real-time share is named") {
  FakeFacts facts;
  CHECK(has_fix(check_sched_fifo(facts, refused(EPERM)), "ada - rtprio 99"));
  facts.write({{"/proc/self/cgroup", "3:cpu:/jobs\n"},
               {"/proc/self/mounts", "cgroup /cg/cpu cgroup rw,cpu 0 0\n"},
               {"/cg/cpu/jobs/cpu.rt_runtime_us", "0\n"},
               {"/cg/cpu/jobs/cpu.rt_period_us", "1000000\n"}});
  CHECK(has_fix(check_sched_fifo(facts, refused(EPERM)), "/cg/cpu/jobs/cpu.rt_runtime_us"));
  CHECK(check_cgroup_rt(facts).status == Status::lacks);
  const Finding granted = after(facts, {{"/cg/cpu/jobs/cpu.rt_runtime_us", "950000\n"}}, check_cgroup_rt);
  CHECK(granted.status == Status::ok);
  CHECK(says(granted, "950 ms of 1000 ms"));
}

TEST_CASE("control groups v2 have no share; RT_GROUP_SCHED then refuses all but the root group") {
  FakeFacts facts;
  const auto status = [&](const Files& files) { return after(facts, files, check_cgroup_rt).status; };
  CHECK(status({{"/proc/self/cgroup", "0::/user.slice\n"}, {"/proc/config.gz", "CONFIG_RT_GROUP_SCHED=y\n"}}) ==
        Status::warn);
  CHECK(status({{"/proc/cmdline", "rt_group_sched=0"}}) == Status::ok);
  CHECK(status({{"/proc/cmdline", ""}, {"/proc/self/cgroup", "0::/\n"}}) == Status::ok);
}

TEST_CASE("the kernel's share for real-time policies") {
  FakeFacts facts;
  CHECK(check_rt_runtime(facts).status == Status::unknown);
  facts.files["/proc/sys/kernel/sched_rt_period_us"] = "1000000\n";
  for (const auto& one : {std::pair{"950000\n", Status::ok}, std::pair{"-1\n", Status::warn},
                          std::pair{"500000\n", Status::warn}, std::pair{"0\n", Status::lacks}}) {
    const std::string runtime = one.first;
    const Status status = one.second;
    facts.files["/proc/sys/kernel/sched_rt_runtime_us"] = runtime;
    CAPTURE(runtime);
    CHECK(check_rt_runtime(facts).status == status);
    CHECK(check_rt_runtime(facts).fixes.empty() == (status == Status::ok));
  }
}

TEST_CASE("the fair server exists since Linux 6.12 and shows itself in debugfs only") {
  FakeFacts facts;
  const auto found = [&](const Files& files) { return after(facts, files, check_fair_server); };
  const std::string folder = "/sys/kernel/debug/sched/fair_server/cpu0/";
  CHECK(found({{"/proc/sys/kernel/osrelease", "6.1.0\n"}}).status == Status::ok);
  CHECK(found({{"/proc/sys/kernel/osrelease", "6.12.0\n"}}).status == Status::unknown);
  const Finding served = found({{folder + "runtime", "50000000\n"}, {folder + "period", "1000000000\n"}});
  CHECK(served.status == Status::warn);
  CHECK(says(served, "50 ms of 1000 ms"));
  CHECK(found({{folder + "runtime", "0\n"}}).status == Status::ok);
}

TEST_CASE("mlockall counts only if the pages are locked and more can be") {
  FakeFacts facts;
  LockTrial trial{true, 0, 200'000, 210'000, 0, -1};
  CHECK(check_mlockall(facts, trial).status == Status::ok);
  trial.more_error = ENOMEM;
  CHECK(check_mlockall(facts, trial).status == Status::lacks);
  trial.more_error = 0;
  trial.locked_kb = 100;
  CHECK(check_mlockall(facts, trial).status == Status::lacks);
  trial.error = EPERM;
  trial.limit_kb = 8192;
  CHECK(says(check_mlockall(facts, trial), "limit 8192 KiB"));
  CHECK(has_fix(check_mlockall(facts, trial), "ada - memlock unlimited"));
}

TEST_CASE("shared memory, huge pages, swap") {
  SharedMemoryTrial shm{true, 0, 2000, 1500};
  CHECK(check_dev_shm(shm).status == Status::ok);
  shm.free_mb = 64;
  CHECK(check_dev_shm(shm).status == Status::warn);
  shm.error = EACCES;
  CHECK(check_dev_shm(shm).status == Status::lacks);
  CHECK(has_fix(check_dev_shm(shm), "chmod"));
  shm = {true, ENOENT, 0, 0};
  CHECK(has_fix(check_dev_shm(shm), "mount -t tmpfs"));

  FakeFacts facts;
  CHECK(check_transparent_hugepage(facts).status == Status::ok);
  const Finding always = after(facts, {{"/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never\n"}},
                               check_transparent_hugepage);
  CHECK(always.status == Status::warn);
  CHECK(has_fix(always, "kernel command line: transparent_hugepage=madvise"));
  CHECK(check_swap(facts).status == Status::unknown);
  const Finding swaps =
      after(facts, {{"/proc/swaps", "Filename Type Size Used Priority\n/swap file 1 0 -2\n"}}, check_swap);
  CHECK(swaps.status == Status::warn);
  CHECK(says(swaps, "/swap"));
}

TEST_CASE("idle states: refused is a lack, absent is not") {
  FakeFacts facts;
  CHECK(check_cpu_dma_latency(facts, {true, EACCES, -1}).status == Status::lacks);
  CHECK(check_cpu_dma_latency(facts, {true, ENOENT, -1}).status == Status::warn);
  CHECK(check_cpu_dma_latency(facts, {true, 0, 0}).status == Status::ok);
  CHECK(check_cpu_dma_latency(facts, {true, 0, 20}).status == Status::warn);
  CHECK(check_timer_slack({true, 0, 1}).status == Status::ok);
  CHECK(check_timer_slack({true, 0, 50'000}).status == Status::lacks);
}

TEST_CASE("the tick, as the clock and the configuration tell it") {
  FakeFacts facts;
  facts.files["/proc/config.gz"] = "CONFIG_HZ=250\n";
  CHECK(check_tick(facts, {true, 4'000'000, 4'000'000}).status == Status::warn);
  CHECK(says(check_tick(facts, {true, 4'000'000, 8'000'000}), "250 Hz by the clock's resolution, steps of 8000 us"));
  CHECK(check_tick(facts, {true, 1'000'000, 0}).status == Status::ok);
  CHECK(check_tick(facts, {}).status == Status::unknown);
}

TEST_CASE("the preemption model, from whoever tells it") {
  FakeFacts facts;
  const auto found = [&](const Files& files) { return after(facts, files, check_preemption); };
  CHECK(found({}).status == Status::unknown);
  const Finding configured = found({{"/proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n"},
                                    {"/proc/config.gz", "CONFIG_PREEMPT_NONE=y\nCONFIG_PREEMPT_DYNAMIC=y\n"}});
  CHECK(says(configured, "none (kernel configuration)"));
  CHECK(configured.status == Status::warn);
  CHECK(has_fix(configured, "preempt=full"));
  CHECK(found({{"/proc/cmdline", "preempt=full quiet"}}).status == Status::ok);
  const Finding voluntary = found({{"/sys/kernel/debug/sched/preempt", "none (voluntary) full\n"}});
  CHECK(says(voluntary, "voluntary (debugfs)"));
  CHECK(voluntary.status == Status::warn);
  CHECK(found({{"/sys/kernel/debug/sched/preempt", "none voluntary full (lazy)\n"}}).status == Status::warn);
  CHECK(says(found({{"/sys/kernel/realtime", "1\n"}}), "rt"));
  facts = FakeFacts();
  CHECK(has_fix(
      found({{"/proc/sys/kernel/osrelease", "5.10.0\n"}, {"/boot/config-5.10.0", "CONFIG_PREEMPT_VOLUNTARY=y\n"}}),
      "linux-image-rt"));
}

TEST_CASE("clock and frequency") {
  FakeFacts facts;
  CHECK(check_clocksource(facts).status == Status::unknown);
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  CHECK(after(facts, {{folder + "current_clocksource", "tsc\n"}}, check_clocksource).status == Status::ok);
  const Finding slow = after(
      facts, {{folder + "current_clocksource", "hpet\n"}, {folder + "available_clocksource", "hpet tsc acpi_pm\n"}},
      check_clocksource);
  CHECK(slow.status == Status::warn);
  CHECK(has_fix(slow, "echo tsc"));
  CHECK(check_governor(facts).status == Status::unknown);
  const std::string policies = "/sys/devices/system/cpu/cpufreq/policy";
  CHECK(after(facts, {{policies + "0/scaling_governor", "performance\n"}}, check_governor).status == Status::ok);
  const Finding mixed = after(facts, {{policies + "1/scaling_governor", "powersave\n"}}, check_governor);
  CHECK(mixed.status == Status::warn);
  CHECK(says(mixed, "performance, powersave"));
}

TEST_CASE("CPUs that a process may use, shared or of its own") {
  FakeFacts facts;
  CHECK(check_cpusets(facts).status == Status::ok);
  facts.cpus = {1};
  CHECK(check_cpusets(facts).status == Status::warn);
  CHECK(has_fix(check_cpusets(facts), "echo 1 | sudo tee takt/cpuset.cpus"));
  const auto found = [&](const Files& files) { return after(facts, files, check_cpusets); };
  const std::string partition = "/sys/fs/cgroup/takt/cpuset.cpus.partition";
  CHECK(found({{"/proc/self/cgroup", "0::/takt\n"},
               {"/proc/self/mounts", "cgroup2 /sys/fs/cgroup cgroup2 rw 0 0\n"},
               {partition, "root\n"}})
            .status == Status::ok);
  CHECK(found({{partition, "root invalid (no CPU)\n"}}).status == Status::warn);
  CHECK(says(found({{"/sys/devices/system/cpu/isolated", "1\n"}}), "isolated: 1"));
}

TEST_CASE("interrupts and stolen time") {
  FakeFacts facts;
  CHECK(check_irq_affinity(facts).status == Status::unknown);
  const auto interrupts = [&](const Files& files) { return after(facts, files, check_irq_affinity); };
  CHECK(interrupts({{"/proc/irq/24/smp_affinity_list", "0-1\n"}, {"/proc/irq/default_smp_affinity", "3\n"}}).status ==
        Status::warn);
  const Finding apart = interrupts({{"/proc/irq/24/smp_affinity_list", "0\n"}});
  CHECK(apart.status == Status::ok);
  CHECK(says(apart, "1 interrupts; CPUs without any: 1"));
  CHECK(check_host_stall(facts).status == Status::unknown);
  const Finding stolen = after(facts, {{"/proc/stat", "cpu  500 0 0 485 0 0 0 15 0 0\n"}}, check_host_stall);
  CHECK(stolen.status == Status::warn);
  CHECK(says(stolen, "1.50 %"));
  CHECK(after(facts, {{"/proc/stat", "cpu  500 0 0 500 0 0 0 0 0 0\n"}}, check_host_stall).status == Status::ok);
}

TEST_CASE("rights: whose they are, and whether every user of the machine has them") {
  FakeFacts facts;
  CHECK(check_rights(facts, {}).status == Status::unknown);
  constexpr uint64_t kBoth = 1U << CAP_SYS_NICE | 1U << CAP_IPC_LOCK;
  const Finding open = check_rights(facts, {true, kBoth, true, 0755});
  CHECK(open.status == Status::warn);
  CHECK(says(open, "CAP_IPC_LOCK CAP_SYS_NICE, by the program's file, which every user"));
  CHECK(has_fix(open, "chgrp takt /opt/takt"));
  CHECK(check_rights(facts, {true, kBoth, true, 0750}).status == Status::ok);
  CHECK(says(check_rights(facts, {true, kBoth, false, 0755}), "by who started it"));
  CHECK(says(check_rights(facts, {true, 0, false, 0755}), "none"));
  facts.root = true;
  CHECK(says(check_rights(facts, {true, ~uint64_t{0}, false, 0755}), "root"));
}

TEST_CASE("the machine's watchdog: none, free, held, armed by nobody") {
  machine::WatchdogTrial trial;
  CHECK(check_watchdog(trial).status == Status::unknown);
  trial.answered = true;
  CHECK(says(check_watchdog(trial), "no watchdog device"));
  trial.there = true;
  trial.timeout_s = 30;
  std::strcpy(trial.name.data(), "watchdog0 (softdog)");
  CHECK(says(check_watchdog(trial), "watchdog0 (softdog), 30 s: nobody holds it"));
  CHECK(has_fix(check_watchdog(trial), "RuntimeWatchdogSec"));
  trial.active = true;
  CHECK(check_watchdog(trial).status == Status::ok);
  CHECK(says(check_watchdog(trial), "only root sees who holds it"));
  trial.sees_all = true;
  CHECK(check_watchdog(trial).status == Status::warn);
  std::strcpy(trial.holder.data(), "systemd (pid 1)");
  CHECK(check_watchdog(trial).status == Status::ok);
  CHECK(says(check_watchdog(trial), "held by systemd (pid 1)"));
}

TEST_CASE("a run lacks what every run needs and what its own policy needs, and nothing else") {
  const auto finding = [](const char* name, machine::Need need, Status status) {
    return Finding{"group", name, need, status, "", ""};
  };
  const std::vector<Finding> findings{finding("deadline", machine::Need::deadline, Status::lacks),
                                      finding("fixed", machine::Need::fixed, Status::lacks),
                                      finding("lock", machine::Need::every_run, Status::lacks),
                                      finding("slack", machine::Need::every_run, Status::warn),
                                      finding("shm", machine::Need::iceoryx, Status::lacks),
                                      finding("tick", machine::Need::advice, Status::lacks)};
  const auto names = [&](Policy policy, bool iceoryx) {
    std::string text;
    for (const Finding& f : lacking(findings, policy, iceoryx)) text += f.name + " ";
    return text;
  };
  CHECK(names(Policy::deadline, false) == "deadline lock ");
  CHECK(names(Policy::fixed, true) == "fixed lock shm ");
  CHECK(names(Policy::cooperative, false) == "lock ");
}

TEST_CASE("every check names itself, what it found and what it means; a lack always has a fix") {
  Trials trials;
  trials.deadline = trials.fixed = refused(EPERM);
  trials.lock = {true, EPERM, 0, 1000, 0, 64};
  trials.latency = {true, EACCES, -1};
  trials.slack = {true, EPERM, 50'000};
  trials.shared_memory = {true, EACCES, 10, 10};
  trials.daemon.answered = true;
  std::strcpy(trials.daemon.refused.data(), "another iceoryx daemon is running");
  for (const bool root : {false, true}) {
    FakeFacts facts;
    facts.root = root;
    for (const Trials& tried : {trials, Trials{}}) {
      for (const Finding& finding : examine(facts, tried)) {
        CAPTURE(finding.name);
        CHECK(!finding.name.empty());
        CHECK(!finding.found.empty());
        CHECK(!finding.meaning.empty());
        CHECK(finding.meaning.size() <= 70);  // one line of the table
        if (finding.status == Status::lacks) CHECK(!finding.fixes.empty());
        if (finding.status == Status::ok) CHECK(finding.fixes.empty());
      }
    }
  }
}

TEST_CASE("this machine is tried without a trace: neither policy nor locked memory stays") {
  const std::string before = SystemFacts().text("/proc/self/status").value_or("");
  const Trials trials = try_machine();
  CHECK(trials.deadline.answered);
  CHECK(trials.lock.answered);
  CHECK(trials.tick.answered);
  const auto locked = [](const std::string& status) { return status.substr(status.find("VmLck"), 24); };
  CHECK(locked(SystemFacts().text("/proc/self/status").value_or("VmLck")) == locked(before));
}

TEST_CASE("a trial that hangs or dies is no answer") {
  struct Answer {
    int value = 0;
  };
  const auto answer = in_child<Answer>([] { return Answer{7}; });
  REQUIRE(answer);
  CHECK(answer->value == 7);
  CHECK(!in_child<Answer>([]() -> Answer { throw std::runtime_error("no"); }));
  CHECK(!in_child<Answer>([]() -> Answer { _exit(3); }));
  CHECK(!in_child<Answer>(
      []() -> Answer {
        while (true) pause();
      },
      10'000'000));
}
