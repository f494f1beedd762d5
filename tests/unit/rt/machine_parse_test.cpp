// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "rt/machine/identity.hpp"
#include "rt/machine/measure.hpp"
#include "rt/machine/parse.hpp"
#include "tests/unit/rt/fake_facts.hpp"

using namespace takt::machine;

TEST_CASE("lists of CPUs as the kernel writes them") {
  CHECK(parse_cpu_list("0-2,5\n") == std::vector<int>{0, 1, 2, 5});
  CHECK(parse_cpu_list("7") == std::vector<int>{7});
  CHECK(parse_cpu_list("3,1-2,2") == std::vector<int>{1, 2, 3});
  CHECK(parse_cpu_list("").empty());
  CHECK(parse_cpu_list("\n").empty());
  CHECK(parse_cpu_list("none").empty());
  CHECK(parse_cpu_list("0-99999999").size() == 4096);
  CHECK(cpu_list_text({0, 1, 2, 5}) == "0-2,5");
  CHECK(cpu_list_text({}) == "");
}

TEST_CASE("the chosen word of a kernel switch") {
  CHECK(chosen_word("always [madvise] never\n") == "madvise");
  CHECK(chosen_word("none voluntary (full)\n") == "full");
  CHECK(chosen_word("0\n") == "");
  CHECK(chosen_word("[") == "");
}

TEST_CASE("options of the kernel's configuration and of its command line") {
  const char* config = "# comment\nCONFIG_HZ_250=y\nCONFIG_HZ=250\n# CONFIG_PREEMPT_RT is not set\nCONFIG_PREEMPT=y\n";
  CHECK(kernel_option(config, "HZ") == "250");
  CHECK(kernel_option(config, "PREEMPT") == "y");
  CHECK(kernel_option(config, "PREEMPT_RT") == "n");
  CHECK(!kernel_option(config, "PREEMPT_LAZY"));
  CHECK(boot_option("quiet preempt=full isolcpus=1 -- preempt=none", "preempt") == "full");
  CHECK(boot_option("preempt=none preempt=full", "preempt") == "full");
  CHECK(!boot_option("nopreempt=1", "preempt"));
}

TEST_CASE("release numbers compare as numbers") {
  CHECK(parse_release("6.12.3-rt5").at_least(6, 12));
  CHECK(!parse_release("6.9.0").at_least(6, 12));
  CHECK(parse_release("7.0").at_least(6, 12));
  CHECK(!parse_release("nonsense").at_least(0, 1));
}

TEST_CASE("where the control group of a process is") {
  const char* groups = "9:name=systemd:/\n3:cpu,cpuacct:/user/one\n2:cpuset:/sets/a\n0::/slice/x\n";
  CHECK(cgroup_path(groups, "cpu") == "/user/one");
  CHECK(cgroup_path(groups, "cpuset") == "/sets/a");
  CHECK(cgroup_path(groups, "") == "/slice/x");
  CHECK(!cgroup_path(groups, "memory"));
  CHECK(!cgroup_path("garbage", "cpu"));
  const char* mounts =
      "proc /proc proc rw 0 0\ncgroup /sys/fs/cgroup/cpu cgroup rw,relatime,cpu,cpuacct 0 0\n"
      "cgroup2 /sys/fs/cgroup/unified cgroup2 rw 0 0\n";
  CHECK(cgroup_mount(mounts, "cpu") == "/sys/fs/cgroup/cpu");
  CHECK(cgroup_mount(mounts, "") == "/sys/fs/cgroup/unified");
  CHECK(!cgroup_mount(mounts, "cpuset"));
}

TEST_CASE("what /proc/stat says of stolen time") {
  const auto times = parse_cpu_times("cpu  100 0 50 800 5 0 5 40 0 0\ncpu0 1 2 3\n");
  REQUIRE(times);
  CHECK(times->total == 1000);
  CHECK(times->steal == 40);
  CHECK(!parse_cpu_times("cpu  1 2 3\n"));
  CHECK(!parse_cpu_times("cpu  1 2 3 x 5 6 7 8 9 10\n"));
  CHECK(!parse_cpu_times(""));
}

TEST_CASE("swap devices") {
  CHECK(swap_devices("Filename\tType\tSize\tUsed\tPriority\n").empty());
  CHECK(swap_devices("Filename Type Size Used Priority\n/dev/sda2 partition 1000 0 -2\n") ==
        std::vector<std::string>{"/dev/sda2"});
}

TEST_CASE("a machine is told by processor, cores and kernel; boards name no model") {
  takt::test::FakeFacts facts;
  facts.files["/proc/cpuinfo"] = "processor\t: 0\nmodel name\t: Some CPU @ 2 GHz\nprocessor : 1\nmodel name : other\n";
  facts.files["/proc/sys/kernel/osrelease"] = "6.1.0-18-amd64\n";
  facts.files["/proc/sys/kernel/version"] = "#1 SMP\n";
  const Identity here = Identity::of(facts);
  CHECK(here.cpu == "Some CPU @ 2 GHz");
  CHECK(here.cores == 2);
  CHECK(here.kernel == "6.1.0-18-amd64 #1 SMP");
  facts.files.erase("/proc/cpuinfo");
  facts.files["/proc/device-tree/model"] = std::string("Board 5\0", 8);
  CHECK(Identity::of(facts).cpu == "Board 5");
}

TEST_CASE("a spread keeps every sample, and has a 99th percentile only of a hundred") {
  std::vector<int64_t> ns;
  for (int i = 1; i <= 99; ++i) ns.push_back(i * 1000);
  CHECK(Spread::of(ns).samples == 99);
  CHECK(!Spread::of(ns).has_p99());
  CHECK(Spread::of(ns).charged_us() == 99);
  ns.insert(ns.begin(), 5'000'000);
  const Spread spread = Spread::of(ns);
  CHECK(spread.has_p99());
  CHECK(spread.p50_us == 50);
  CHECK(spread.p99_us == 99);
  CHECK(spread.charged_us() == 99);
  CHECK(spread.max_us == 5000);
  CHECK(Spread::of({}).samples == 0);
}

TEST_CASE("holes are the host's unless another thread was scheduled") {
  Stalls stalls;
  stalls.add(30'000, false);
  stalls.add(2'000'000, false);
  stalls.add(50'000'000, true);
  CHECK(stalls.count == 2);
  CHECK(stalls.over_1ms == 1);
  CHECK(stalls.sum_ns == 2'030'000);
  CHECK(stalls.max_ns == 2'000'000);
  CHECK(stalls.preempted == 1);
  CHECK(stalls.preempted_max_ns == 50'000'000);
}

TEST_CASE("bisecting finds the largest accepted value, like trying them one by one") {
  for (int64_t limit = 0; limit <= 40; ++limit) {
    int asked = 0;
    const auto accepts = [&](int64_t value) { return ++asked, value <= limit; };
    CHECK(bisect_largest(0, 41, 1, accepts) == limit);
    CHECK(asked <= 6);
  }
}
