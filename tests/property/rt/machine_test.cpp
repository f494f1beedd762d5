// SPDX-License-Identifier: Apache-2.0
// What the checks read comes from the kernel and may be anything; what the measurements sum up is compared with
// counting.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "rt/machine/parse.hpp"
#include "rt/machine/spread.hpp"
#include "tests/property_scale.hpp"

using namespace takt::machine;
using namespace std::string_literals;

TEST_CASE("a list of CPUs survives writing and reading") {
  std::mt19937 random(takt::test::seed(1));
  for (int round = 0; round < takt::test::rounds(2'000); ++round) {
    std::vector<int> cpus;
    const auto one_in = 1 + random() % 8;
    for (int cpu = 0; cpu < 130; ++cpu)
      if (random() % one_in == 0) cpus.push_back(cpu);
    CHECK(parse_cpu_list(cpu_list_text(cpus)) == cpus);
  }
}

TEST_CASE("no text breaks a parser") {
  std::mt19937 random(takt::test::seed(2));
  const std::string letters = "0123456789-,:=.[]() \n\tcpuCONFIG_HZ#yn\\/\0\xff"s;
  for (int round = 0; round < takt::test::rounds(20'000); ++round) {
    std::string text;
    for (auto length = random() % 60; length > 0; --length) text += letters[random() % letters.size()];
    for (const int cpu : parse_cpu_list(text)) CHECK((cpu >= 0 && cpu <= 4095));
    chosen_word(text);
    kernel_option(text, "HZ");
    boot_option(text, "cpu");
    parse_release(text);
    cgroup_path(text, "cpu");
    cgroup_mount(text, "cpu");
    parse_cpu_times(text);
    swap_devices(text);
    parse_number(text);
    line_value(text, "cpu");
    for (const std::string_view word : words_of(text)) CHECK(!word.empty());
  }
}

TEST_CASE("quantiles of a spread are what counting samples gives") {
  std::mt19937 random(takt::test::seed(3));
  for (int round = 0; round < takt::test::rounds(300); ++round) {
    std::vector<int64_t> ns(1 + random() % 500);
    for (int64_t& sample : ns) sample = static_cast<int64_t>(random() % 1'000) * 1'000;
    // The smallest sample that at least `percent` of all do not exceed, by trying each.
    const auto reference_us = [&](uint64_t percent) {
      int64_t best = -1;
      for (const int64_t candidate : ns) {
        const auto below = std::count_if(ns.begin(), ns.end(), [&](int64_t s) { return s <= candidate; });
        if (static_cast<uint64_t>(below) * 100 >= percent * ns.size() && (best < 0 || candidate < best))
          best = candidate;
      }
      return static_cast<double>(best) / 1e3;
    };
    const Spread spread = Spread::of(ns);
    CHECK(spread.p50_us == reference_us(50));
    CHECK(spread.p99_us == reference_us(99));
    CHECK(spread.max_us == reference_us(100));
    CHECK(spread.samples == static_cast<int64_t>(ns.size()));
  }
}
