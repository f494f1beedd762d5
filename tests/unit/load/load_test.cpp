// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <ctime>
#include <string>

#include "nodes/load/burn.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/testing.hpp"
#include "tests/nanoseconds.hpp"

namespace takt {
void register_load(NodeTypes& types);
}

using namespace takt;

namespace {

using test::kMs;

struct Fixture {
  MonotonicClock real;
  VirtualClock imagined;
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<TextStatus>> out;
  test::Box<TextStatus> in{{0, 0, 1, 64}};

  explicit Fixture(const std::vector<std::pair<std::string, ParamValue>>& params, bool real_time = true) {
    NodeTypes types;
    register_load(types);
    node = types.find("load")->make();
    for (const auto& [name, value] : params) test::set(*node, name, value);
    const Clock& clock = real_time ? static_cast<const Clock&>(real) : imagined;
    Setup setup{clock, ".", ".", 0, std::nullopt, 0};
    node->setup(setup);
    out = std::make_unique<test::BoxWriter<TextStatus>>(*node->outputs()[0]);
    out->refuses = true;
  }
  uint64_t allocations = 0;  ///< of the last job

  /// CPU time of the job.
  int64_t job(uint64_t index, int64_t release_ns = 7) {
    out->clear();
    Job job(real, index, release_ns, release_ns + 100 * kMs, 0, "full");
    take_thread_use();
    node->run(job);
    const ThreadUse used = take_thread_use();
    allocations = used.allocations;
    CHECK_FALSE(job.without_result());
    REQUIRE(out->sent());
    return used.cpu_ns;
  }
  std::string text() { return {out->message().text.data(), out->message().text.size}; }
};

}  // namespace

TEST_CASE("load: a job uses the CPU time it is told to, more in each every-th job, and allocates nothing") {
  Fixture f({{"work", 0.002}, {"extra", 0.003}, {"every", int64_t{3}}});
  for (uint64_t index = 0; index < 6; ++index) {
    CAPTURE(index);
    const int64_t wanted = index % 3 == 2 ? 5 * kMs : 2 * kMs;
    // CPU time and not wall time: no load of the machine can make it longer, but for interrupts charged to us.
    const int64_t used = f.job(index);
    CHECK(used >= wanted);
    CHECK(used < wanted + kMs);
    CHECK(f.allocations == 0);
  }
}

TEST_CASE("load: its output names the job and carries the input's stamp on") {
  Fixture f({{"work", 0.0}});
  f.job(12);
  CHECK(f.text() == "12");
  CHECK(f.out->stamp_ns() == 7);
  test::latch(test::input(*f.node, "input"), f.in, 5, 1);
  f.job(13);
  CHECK(f.text() == "13");
  CHECK(f.out->stamp_ns() == 5);
}

TEST_CASE("load: a flood fills its message up to the capacity, and sends until it is refused") {
  Fixture f({{"work", 0.0}, {"flood", true}, {"message_size", int64_t{5000}}});
  for (uint64_t index = 4; index < 7; ++index) f.job(index);
  CHECK(f.text().size() == 5000);
  CHECK(f.text().substr(0, 3) == "6..");
  CHECK(f.out->refused == 3);
  test::set(*f.node, "flood", false);
  f.job(7);
  CHECK(f.text() == "7");
  CHECK(f.out->refused == 3);
}

TEST_CASE("load: allocates once, at the job it is told to") {
  Fixture f({{"work", 0.0}, {"allocate", int64_t{3}}, {"allocate_at", int64_t{1}}});
  for (uint64_t index = 0; index < 3; ++index) {
    f.job(index);
    if (counting_allocations()) CHECK(f.allocations == (index == 1 ? 1 : 0));
  }
}

TEST_CASE("load: gets stuck every so often, by releases; the first job never is") {
  load::Trouble trouble;
  std::string stuck;
  for (int64_t release = 0; release < 10; ++release) stuck += trouble.due(release, 3) ? 'x' : '.';
  CHECK(stuck == "...x..x..x");
  load::Trouble never;
  for (int64_t release = 0; release < 10; ++release) CHECK_FALSE(never.due(release, 0));
  Fixture f({{"work", 0.0}, {"stuck_every", 1.0}, {"stuck_for", 0.004}});
  CHECK(f.job(0, 0) < 4 * kMs);
  CHECK(f.job(1, 500 * kMs) < 4 * kMs);
  CHECK(f.job(2, 1000 * kMs) >= 4 * kMs);
}

TEST_CASE("load: in virtual time it neither burns nor sleeps nor gets stuck") {
  Fixture f({{"work", 60.0}, {"sleep", 60.0}, {"stuck_every", 0.001}}, false);
  for (uint64_t index = 0; index < 3; ++index) f.job(index, static_cast<int64_t>(index) * 100 * kMs);
  CHECK(f.text() == "2");
}
