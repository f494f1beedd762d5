// SPDX-License-Identifier: Apache-2.0
#include "hal/newest.hpp"

#include <doctest/doctest.h>

#include <thread>

using namespace takt;

TEST_CASE("the newest is handed over once") {
  Newest<int> newest;
  CHECK(newest.take() == nullptr);
  newest.draft() = 1;
  newest.publish();
  newest.draft() = 2;
  newest.publish();
  const int* taken = newest.take();
  REQUIRE(taken != nullptr);
  CHECK(*taken == 2);
  newest.draft() = 3;
  newest.publish();
  CHECK(*taken == 2);  // the reader's until it takes the next
  CHECK(*newest.take() == 3);
  CHECK(newest.take() == nullptr);
}

TEST_CASE("between two threads: whole values, in order, and the last one") {
  struct Pair {
    uint64_t a = 0, b = 0;
  };
  constexpr uint64_t kLast = 200'000;
  Newest<Pair> newest;
  std::thread writer([&] {
    for (uint64_t i = 1; i <= kLast; ++i) {
      newest.draft() = {i, ~i};
      newest.publish();
    }
  });
  uint64_t seen = 0, torn = 0, backwards = 0;
  while (seen < kLast) {
    const Pair* pair = newest.take();
    if (pair == nullptr) continue;
    torn += pair->b != ~pair->a;
    backwards += pair->a <= seen;
    seen = pair->a;
  }
  writer.join();
  CHECK(torn == 0);
  CHECK(backwards == 0);
}
