// SPDX-License-Identifier: Apache-2.0
// A suite is one file in bench/suites with one function; suites.cpp lists them.
#pragma once
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "bench/statistics.hpp"
#include "rt/sched/grant.hpp"

namespace takt::bench {

struct Options {
  int rounds =
      0;  ///< interleaved; 0: the suite's own default, for about two minutes (release: six, release_loads: ten)
  std::string only;  ///< one of the suite's conditions; empty: all of them
  int rounds_or(int standard) const { return rounds > 0 ? rounds : standard; }
  bool wants(std::string_view condition) const { return only.empty() || only == condition; }
};

/// Thrown by a suite that cannot run here (exit 3).
struct CannotRun : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Suite {
  std::string_view name, what;
  std::vector<Row> (*run)(const Options&);
  std::vector<std::string> (*conditions)() = nullptr;  ///< what Options::only may name; none: measured as a whole
};

std::span<const Suite> suites();

/// Why the suite cannot measure this condition alone, with those that it has; empty: it can, or none is asked for.
std::string refused_condition(const Suite& suite, const std::string& condition);

/// Column `granted`: policy, priority and CPU as read back, or the refusal.
std::string granted_text(const Grant& grant);

/// Rows of B against A, and of A against itself ("NAME_null"), from interleaved rounds.
void add_pair(std::vector<Row>& rows, Row row, const std::string& reference, const Pairs& pairs);

}  // namespace takt::bench
