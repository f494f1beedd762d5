// SPDX-License-Identifier: Apache-2.0
#include "rt/time/rate.hpp"

#include <doctest/doctest.h>

using takt::Rate;

TEST_CASE("releases of 7 Hz stay exact over a week") {
  const Rate rate{7, 1};
  const int64_t week = 7LL * 24 * 3600;
  CHECK(rate.release_ns(0, 7 * week) == week * 1'000'000'000);
  CHECK(rate.release_ns(5, 7 * week) == week * 1'000'000'000 + 5);
  CHECK(rate.release_ns(0, 1) == 142857142);
}

TEST_CASE("releases_before counts exactly the planned releases in the window") {
  for (const Rate rate : {Rate{15, 1}, Rate{7, 1}, Rate{2, 1}, Rate{30000, 1001}, Rate{1, 3}}) {
    for (int64_t end :
         {0LL, 1LL, 999'999'999LL, 1'000'000'000LL, 1'000'000'001LL, 20'000'000'000LL, 20'000'000'007LL}) {
      int64_t k = 0;
      while (rate.release_ns(0, k) < end) ++k;
      CHECK(rate.releases_before(0, end) == k);
    }
  }
  CHECK(Rate{15, 1}.releases_before(100, 100) == 0);
  CHECK(Rate{15, 1}.releases_before(200, 100) == 0);
}

TEST_CASE("rates are read as exact fractions") {
  CHECK(Rate::parse("15") == Rate{15, 1});
  CHECK(Rate::parse("7.5") == Rate{15, 2});
  CHECK(Rate::parse("30000/1001") == Rate{30000, 1001});
  CHECK(Rate::parse("4/2") == Rate{2, 1});
  for (const char* bad : {"", "0", "-1", "1/0", "a", "1/", "7.", ".5", "1e3", "15Hz", "7.-5", "-0.5", "99999999999.9"})
    CHECK_FALSE(Rate::parse(bad));
}
