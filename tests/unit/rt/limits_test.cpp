// SPDX-License-Identifier: Apache-2.0
// Which limit is behind a refusal, on machines that say so in text.
#include "rt/machine/limits.hpp"

#include <doctest/doctest.h>
#include <sys/resource.h>

#include <cerrno>
#include <new>
#include <stdexcept>
#include <system_error>

#include "tests/has.hpp"
#include "tests/unit/rt/fake_facts.hpp"

using namespace takt::machine;
using takt::test::has;

namespace {

/// In a group of cgroup v2 within another one, whose limits are the tighter ones.
takt::test::FakeFacts in_groups() {
  takt::test::FakeFacts facts;
  facts.limits = {{RLIMIT_NPROC, 20}, {RLIMIT_NOFILE, 8}, {RLIMIT_AS, 300'000'000}};
  facts.files["/proc/self/cgroup"] = "0::/robots/ace\n";
  facts.files["/proc/self/mounts"] = "cgroup2 /cg cgroup2 rw 0 0\n";
  facts.files["/cg/robots/ace/pids.max"] = "max\n";
  facts.files["/cg/robots/ace/pids.current"] = "12\n";
  facts.files["/cg/robots/pids.max"] = "30\n";
  facts.files["/cg/robots/pids.current"] = "30\n";
  facts.files["/cg/robots/ace/memory.max"] = "1000000000\n";
  facts.files["/cg/robots/ace/memory.current"] = "900000000\n";
  facts.files["/cg/robots/memory.max"] = "920000000\n";
  facts.files["/cg/robots/memory.current"] = "900000000\n";
  facts.files["/cg/robots/ace/memory.events"] = "low 0\noom 2\noom_kill 3\noom_group_kill 0\n";
  return facts;
}

}  // namespace

TEST_CASE("the tightest group above the process is named where it is full, else the limit of the user") {
  auto facts = in_groups();
  CHECK(has(limit_on(Scarce::tasks, facts), "pids.max 30 of control group /robots: TasksMax="));
  CHECK(has(limit_on(Scarce::memory, facts), "memory limit 920 MB of control group /robots: MemoryMax="));
  facts.files["/cg/robots/pids.current"] = "7\n";
  facts.files["/cg/robots/memory.current"] = "7\n";
  facts.files["/cg/robots/ace/memory.current"] = "7\n";
  CHECK(has(limit_on(Scarce::tasks, facts), "RLIMIT_NPROC 20,"));
  CHECK(limit_on(Scarce::memory, facts) == "RLIMIT_AS 300 MB: ulimit -v unlimited");
  CHECK(has(limit_on(Scarce::files, facts), "RLIMIT_NOFILE 8: ulimit -n"));
}

TEST_CASE("room and kills of a memory group, of cgroup v1 and of none") {
  auto facts = in_groups();
  REQUIRE(memory_room(facts).has_value());
  CHECK(memory_room(facts) == 20'000'000);
  facts.files["/cg/robots/memory.stat"] = "anon 5\ninactive_file 3000000\nactive_file 2000000\nshmem 7\n";
  CHECK(memory_room(facts) == 25'000'000);  // pages of files are dropped first
  CHECK(memory_kills(facts) == 3);

  takt::test::FakeFacts v1;
  v1.files["/proc/self/cgroup"] = "4:memory:/box\n0::/\n";
  v1.files["/proc/self/mounts"] = "cgroup /m cgroup rw,memory 0 0\n";
  v1.files["/m/box/memory.limit_in_bytes"] = "200000000\n";
  v1.files["/m/box/memory.usage_in_bytes"] = "150000000\n";
  v1.files["/m/memory.limit_in_bytes"] = "9223372036854771712\n";
  v1.files["/m/memory.usage_in_bytes"] = "1\n";
  v1.files["/m/box/memory.oom_control"] = "oom_kill_disable 0\nunder_oom 0\noom_kill 1\n";
  v1.files["/m/box/memory.stat"] = "inactive_file 1\ntotal_inactive_file 4000000\n";
  REQUIRE(memory_room(v1).has_value());
  CHECK(memory_room(v1) == 54'000'000);
  CHECK(memory_kills(v1) == 1);

  const takt::test::FakeFacts nothing;  // no /proc
  CHECK_FALSE(memory_room(nothing).has_value());
  CHECK(memory_kills(nothing) == 0);
  for (const Scarce what : {Scarce::tasks, Scarce::memory, Scarce::files}) CHECK(limit_on(what, nothing).empty());
}

TEST_CASE("errors say what ran out; others stay as they are") {
  const auto facts = in_groups();
  CHECK(has(explain(std::bad_alloc(), facts), "no more memory (memory limit 920 MB"));
  CHECK(has(explain(std::system_error(EAGAIN, std::generic_category()), facts),
            "no more threads or processes (pids.max 30"));
  CHECK(has(explain("FILE", EMFILE, facts), "FILE: Too many open files (RLIMIT_NOFILE 8"));
  CHECK(explain(std::runtime_error("the disk is full"), facts) == "the disk is full");
  CHECK(explain("FILE", ENOENT, facts) == "FILE: No such file or directory");
  CHECK(explain(std::bad_alloc(), takt::test::FakeFacts()) == "no more memory");
}
