// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check_machine.hpp"

#include <doctest/doctest.h>

#include "tests/unit/rt/fake_facts.hpp"

using namespace takt;
using namespace takt::graph;

namespace {

test::FakeFacts machine_six() {
  test::FakeFacts facts;
  facts.write({{"/proc/cpuinfo", "processor\t: 0\nmodel name\t: Six\n"},
               {"/proc/sys/kernel/osrelease", "6.18.1\n"},
               {"/proc/sys/kernel/version", "#1 SMP\n"},
               {"/proc/sys/kernel/sched_rt_runtime_us", "950000\n"},
               {"/proc/sys/kernel/sched_rt_period_us", "1000000\n"}});
  return facts;
}

constexpr const char* kMeasured =
    R"({"machine": {"cpu": "Six", "cores": 2, "kernel": "6.18.1 #1 SMP"}, "measured_at": "2026-11-21T22:45:00Z",
        "release_us": 60.5, "switch_us": 3, "publish_us": 1, "take_us": 0.5, "per_mb_us": 10,
        "enforcement_us": null, "demotion_us": 30, "deadline_bandwidth": 1.8})";

}  // namespace

TEST_CASE("overheads: assumed where nobody measured, with the bandwidth of the kernel's settings") {
  test::FakeFacts facts = machine_six();
  const CheckMachine found = check_machine(facts, "/m.json");
  CHECK(!found.measured);
  CHECK(found.warnings.empty());
  CHECK(found.overheads_from.find("assumed") != std::string::npos);
  CHECK(found.overheads.deadline_bandwidth == doctest::Approx(1.8));  // 2 * (0.95 - 0.05)
  CHECK(found.overheads.enforcement_ns == found.overheads.tick_ns);
  facts.files["/proc/sys/kernel/osrelease"] = "6.1.0-18-amd64\n";  // before the fair server
  CHECK(assumed_overheads(facts).deadline_bandwidth == doctest::Approx(1.9));
}

TEST_CASE("overheads: the share of ordinary threads, the largest of all CPUs") {
  test::FakeFacts facts = machine_six();
  const auto share = [&] {
    const analysis::Overheads o = assumed_overheads(facts);
    return std::pair(o.ordinary_runtime_ns, o.ordinary_period_ns);
  };
  CHECK(share() == std::pair<int64_t, int64_t>(50'000'000, 1'000'000'000));  // the kernel's default
  const std::string folder = "/sys/kernel/debug/sched/fair_server/cpu";
  facts.write({{folder + "0/runtime", "0\n"}, {folder + "0/period", "1000000000\n"}});
  facts.write({{folder + "1/runtime", "20000000\n"}, {folder + "1/period", "500000000\n"}});
  CHECK(share() == std::pair<int64_t, int64_t>(20'000'000, 500'000'000));
  facts.files[folder + "1/runtime"] = "0\n";
  CHECK(share().first == 0);
  facts.files["/proc/sys/kernel/osrelease"] = "6.1.0-18-amd64\n";  // throttling
  CHECK(share() == std::pair<int64_t, int64_t>(50'000'000, 1'000'000'000));
  facts.files["/proc/sys/kernel/sched_rt_runtime_us"] = "-1\n";
  CHECK(share().first == 0);
}

TEST_CASE("overheads: what is enforced on the tick may be late by a whole one") {
  analysis::Overheads o;
  o.tick_ns = 4'000'000;
  o.enforcement_ns = 3'100'000;  // no sample met the worst phase
  CHECK(o.throttled_late_ns() == 4'000'000);
  o.enforcement_ns = 4'200'000;
  CHECK(o.throttled_late_ns() == 4'200'000);
  o.enforcement_ns = 20'000;  // a timer of its own
  CHECK(o.throttled_late_ns() == 20'000);
}

TEST_CASE("overheads: of the file, null as assumed") {
  test::FakeFacts facts = machine_six();
  facts.files["/m.json"] = kMeasured;
  const CheckMachine found = check_machine(facts, "/m.json");
  CHECK(found.measured);
  CHECK(found.warnings.empty());
  CHECK(found.overheads.release_ns == 60'500);
  CHECK(found.overheads.take_ns == 500);
  CHECK(found.overheads.demotion_ns == 30'000);
  CHECK(found.overheads.enforcement_ns == assumed_overheads(facts).enforcement_ns);
  CHECK(found.overheads_from == "overheads measured 2026-11-21T22:45:00Z");
}

TEST_CASE("overheads: the worst of the file, with a margin; unknown if one of them is") {
  test::FakeFacts facts = machine_six();
  std::string text = kMeasured;
  CHECK(!check_machine(facts, "/m.json").worst);
  text.insert(text.rfind('}'), R"(, "worst": {"release_us": 100, "switch_us": 20, "publish_us": 10, "take_us": 5})");
  facts.files["/m.json"] = text;
  const CheckMachine found = check_machine(facts, "/m.json");
  REQUIRE(found.worst);
  CHECK(found.worst->release_ns == 120'000);
  CHECK(found.worst->take_ns == 6'000);
  CHECK(found.worst->per_mb_ns == found.overheads.per_mb_ns);
  CHECK(found.overheads.release_ns == 60'500);
  text.replace(text.find("\"take_us\": 5}"), 12, "\"other\": 5");
  facts.files["/m.json"] = text;
  CHECK(!check_machine(facts, "/m.json").worst);
}

TEST_CASE("a kernel that does not preempt is told with who says so") {
  test::FakeFacts facts = machine_six();
  CHECK(check_machine(facts, "").not_preemptible.empty());
  facts.files["/sys/kernel/debug/sched/preempt"] = "none (voluntary) full\n";
  CHECK(check_machine(facts, "").not_preemptible.find("(preemption voluntary, debugfs)") != std::string::npos);
  facts.files["/sys/kernel/debug/sched/preempt"] = "none voluntary (full)\n";
  CHECK(check_machine(facts, "").not_preemptible.empty());
}

TEST_CASE("overheads: measured on another machine, or not to be read, is a warning") {
  test::FakeFacts facts = machine_six();
  facts.files["/m.json"] = kMeasured;
  facts.files["/proc/sys/kernel/osrelease"] = "6.19.0\n";
  const CheckMachine elsewhere = check_machine(facts, "/m.json");
  REQUIRE(elsewhere.warnings.size() == 1);
  CHECK(elsewhere.warnings[0].find("measured on another machine (Six, 2 cores, Linux 6.18.1") != std::string::npos);
  CHECK(elsewhere.overheads.switch_ns == 3'000);
  for (const char* text :
       {"", "[]", "{\"release_us\": 1}", "{\"machine\": 3}", R"({"machine": {"cpu": "Six", "cores": 2,
       "kernel": "6.19.0 #1 SMP"}, "release_us": -1})",
        R"({"machine": {"cpu": "Six", "cores": 1e300, "kernel": "6.19.0 #1 SMP"}})",
        R"({"machine": {"cpu": "Six", "cores": 2.5, "kernel": "6.19.0 #1 SMP"}})",
        R"({"machine": {"cpu": "Six", "cores": 2, "kernel": "6.19.0 #1 SMP"}, "deadline_bandwidth": -1})"}) {
    CAPTURE(text);
    facts.files["/m.json"] = text;
    const CheckMachine broken = check_machine(facts, "/m.json");
    CHECK(!broken.measured);
    REQUIRE(broken.warnings.size() == 1);
    CHECK(broken.warnings[0].find("no overheads can be read") != std::string::npos);
    CHECK(broken.overheads.release_ns == assumed_overheads(facts).release_ns);
  }
}

TEST_CASE("exclusive cpusets of both hierarchies are seen") {
  test::FakeFacts facts = machine_six();
  const auto exclusive = [&](const std::map<std::string, std::string>& files) {
    facts.write(files);
    return check_machine(facts, "").exclusive;
  };
  CHECK(exclusive({}).empty());
  const std::string second = "/sys/fs/cgroup/robot/cpuset.cpus.", first = "/sys/fs/cgroup/cpuset/";
  CHECK(exclusive({{"/proc/self/cgroup", "0::/robot\n"},
                   {"/proc/self/mounts", "cgroup2 /sys/fs/cgroup cgroup2 rw 0 0\n"},
                   {second + "partition", "member\n"},
                   {second + "effective", "1\n"}})
            .empty());
  CHECK(exclusive({{second + "partition", "root\n"}}) == std::vector<int>{1});
  CHECK(exclusive({{"/proc/self/cgroup", "9:cpuset:/robot\n0::/\n"},
                   {"/proc/self/mounts", "cgroup /sys/fs/cgroup/cpuset cgroup rw,cpuset 0 0\n"},
                   {first + "robot/cpuset.cpus", "0\n"},
                   {first + "robot/cpuset.cpu_exclusive", "1\n"},
                   {first + "cpuset.sched_load_balance", "1\n"}})
            .empty());
  CHECK(exclusive({{first + "cpuset.sched_load_balance", "0\n"}}) == std::vector<int>{0});
}
