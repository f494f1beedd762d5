// SPDX-License-Identifier: Apache-2.0
#include "graph/check/margins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "rt/time/units.hpp"

namespace takt::graph {
namespace {

using analysis::Overheads;

constexpr int64_t kMicrosecond = 1'000;

bool admitted(const Plan& plan, const Overheads& overheads) {
  return admit(plan, overheads, false).answer == Answer::admitted;
}

/// The plan with one figure changed by `edit`, asked again.
class Asking {
 public:
  using Edit = std::function<void(Plan&, int64_t)>;
  Asking(const Plan& plan, Accepts accepts, Edit edit)
      : plan_(plan), accepts_(std::move(accepts)), edit_(std::move(edit)) {}
  bool operator()(int64_t value) const {
    Plan changed = plan_;
    edit_(changed, value);
    return accepts_(changed);
  }

 private:
  const Plan& plan_;
  Accepts accepts_;
  Edit edit_;
};

Accepts admission_with(const Overheads& overheads) {
  return [&overheads](const Plan& plan) { return admitted(plan, overheads); };
}

/// Between a value that is admitted and one that is refused: the two moved together to `step` or 0.1 % of their
/// distance from `base`. Returns the admitted one.
int64_t edge(const Asking& admits, int64_t good, int64_t bad, int64_t base, int64_t step) {
  while (std::abs(bad - good) > std::max(step, std::abs(good - base) / 1000)) {
    const int64_t middle = good + (bad - good) / 2;
    (admits(middle) ? good : bad) = middle;
  }
  return good;
}

int64_t margin_within(const Plan& plan, size_t t, const Accepts& accepts, int64_t most) {
  const int64_t budget = plan.tasks[t].budget_ns;
  int64_t good = budget, bad = budget + most + kMicrosecond;
  const Asking admits(plan, accepts, [t](Plan& p, int64_t ns) { p.tasks[t].budget_ns = ns; });
  // Where cores are assigned anew for every budget an admitted one may lie beyond a refused one: look around the edge.
  for (int again = 0; again < 16; ++again) {
    good = edge(admits, good, bad, budget, kMicrosecond);
    const int64_t margin = good - budget, below = budget + margin * 99 / 100, above = budget + margin * 101 / 100 + 1;
    if (!admits(below)) {
      bad = below;
      good = budget;
    } else if (above < budget + most && admits(above)) {
      good = above;
      bad = budget + most + kMicrosecond;
    } else {
      break;
    }
  }
  return good - budget;
}

class Smallest {
 public:
  Smallest(const Plan& plan, Accepts accepts, std::optional<Change> known = {})
      : plan_(plan), accepts_(std::move(accepts)), best_(std::move(known)) {}

  std::optional<Change> find() {
    try_core();
    for (size_t t = 0; t < plan_.tasks.size(); ++t) {
      try_budget(t);
      try_deadline(t);
      try_rate(t, 0.1);
    }
    return best_;
  }

  std::optional<Change> find_for_ages() {
    for (size_t t = 0; t < plan_.tasks.size(); ++t) {
      try_offset(t);
      try_budget(t);
      try_earlier_deadline(t);
      try_rate(t, 2);
    }
    return best_;
  }

 private:
  void offer(Change::What what, size_t task, double from, double to) {
    const double relative = std::abs(to - from) / from;
    if (!best_ || relative < best_->relative) best_ = Change{what, task, from, to, relative, {}};
  }

  /// Nearest admitted value to the present one, on the way to `far` and no farther than the best change so far.
  std::optional<int64_t> nearest(const Asking& admits, int64_t from, int64_t far, int64_t step) const {
    if (best_) {
      const auto reach = static_cast<int64_t>(best_->relative * static_cast<double>(from));
      far = far < from ? std::max(far, from - reach) : std::min(far, from + reach);
    }
    if (far == from || !admits(far)) return std::nullopt;
    return edge(admits, far, from, from, step);
  }

  void try_core() {
    Plan more = plan_;
    if (more.cores.empty()) more.cores.push_back(0);
    more.cores.push_back(*std::max_element(more.cores.begin(), more.cores.end()) + 1);
    const auto cores = static_cast<double>(more.cores.size());
    if (accepts_(more)) offer(Change::What::cores, kNone, cores - 1, cores);
  }

  void try_budget(size_t t) {
    const int64_t budget = plan_.tasks[t].budget_ns;
    if (budget <= kMicrosecond) return;
    const Asking admits(plan_, accepts_, [t](Plan& p, int64_t ns) { p.tasks[t].budget_ns = ns; });
    if (const auto found = nearest(admits, budget, kMicrosecond, kMicrosecond))
      offer(Change::What::budget, t, to_ms(budget), to_ms(*found));
  }

  void try_deadline(size_t t) {
    const int64_t deadline = plan_.tasks[t].deadline_ns;
    const double rate = effective_rate_hz(plan_, t);
    const auto period = rate > 0 ? static_cast<int64_t>(1e9 / rate) : deadline;
    if (period > deadline) try_deadline(t, period);
  }

  /// Of a message that waits for it.
  void try_earlier_deadline(size_t t) {
    if (plan_.tasks[t].publish == PublishAt::let) try_deadline(t, plan_.tasks[t].budget_ns);
  }

  void try_deadline(size_t t, int64_t far) {
    const int64_t deadline = plan_.tasks[t].deadline_ns;
    const Asking admits(plan_, accepts_, [t](Plan& p, int64_t ns) { p.tasks[t].deadline_ns = ns; });
    if (const auto found = nearest(admits, deadline, far, kMicrosecond))
      offer(Change::What::deadline, t, to_ms(deadline), to_ms(*found));
  }

  void try_offset(size_t t) {
    if (!plan_.tasks[t].rate) return;
    constexpr int64_t kSteps = 8;
    const int64_t offset = plan_.tasks[t].offset_ns, period = plan_.tasks[t].rate->period_ns();
    const double reach = std::min(best_ ? best_->relative : 0.5, 0.5);
    const int64_t step = static_cast<int64_t>(reach * static_cast<double>(period)) / kSteps;
    const Asking admits(plan_, accepts_, [t](Plan& p, int64_t ns) { p.tasks[t].offset_ns = ns; });
    for (int64_t n = 1; n <= kSteps && step >= kMicrosecond; ++n) {
      for (const int64_t to : {offset - n * step, offset + n * step}) {
        if (to < 0 || to >= period || !admits(to)) continue;
        const int64_t least = edge(admits, to, to < offset ? to + step : to - step, offset, kMicrosecond);
        if (const double relative = static_cast<double>(std::abs(least - offset)) / static_cast<double>(period);
            !best_ || relative < best_->relative)
          best_ = Change{Change::What::offset, t, to_ms(offset), to_ms(least), relative, {}};
        return;
      }
    }
  }

  /// On the way to `factor` times the present one.
  void try_rate(size_t t, double factor) {
    if (!plan_.tasks[t].rate) return;
    const double hz = plan_.tasks[t].rate->hz();
    const auto tenths = static_cast<int64_t>(hz * 10);
    const Asking admits(plan_, accepts_, [t](Plan& p, int64_t n) { p.tasks[t].rate = Rate{n, 10}; });
    if (tenths < 2) return;
    const auto far = std::max<int64_t>(1, static_cast<int64_t>(factor * static_cast<double>(tenths)));
    if (const auto found = nearest(admits, tenths, far, 1))
      offer(Change::What::rate, t, hz, static_cast<double>(*found) / 10);
  }

  const Plan& plan_;
  const Accepts accepts_;
  std::optional<Change> best_;
};

}  // namespace

std::vector<int64_t> margins(const Plan& plan, const Overheads& overheads, const Accepts& accepts) {
  std::vector<int64_t> result;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const int64_t most = std::max<int64_t>(plan.tasks[t].deadline_ns - plan.tasks[t].budget_ns, 0);
    int64_t margin = margin_within(plan, t, admission_with(overheads), most);
    // The rest is asked where it may matter: it takes longer.
    Plan grown = plan;
    grown.tasks[t].budget_ns += margin * 99 / 100;
    if (accepts && !accepts(grown)) margin = margin_within(plan, t, accepts, margin);
    result.push_back(margin);
  }
  return result;
}

std::optional<Change> smallest_change(const Plan& plan, const Overheads& overheads) {
  return Smallest(plan, admission_with(overheads)).find();
}

std::optional<Change> smallest_age_change(const Plan& plan, const Accepts& accepted,
                                          const std::optional<Change>& later) {
  return Smallest(plan, accepted, later).find_for_ages();
}

std::string to_string(const Change& change, const Plan& plan) {
  const auto of = [&](const char* what, const char* unit) {
    return fmt::format("{} the {} of {} from {:.6g} {} to {:.6g} {}", change.to < change.from ? "lower" : "raise", what,
                       change.task == kNone ? change.name : plan.tasks[change.task].name, change.from, unit, change.to,
                       unit);
  };
  switch (change.what) {
    case Change::What::budget: return of("budget", "ms");
    case Change::What::deadline: return of("deadline", "ms");
    case Change::What::rate: return of("rate", "Hz");
    case Change::What::offset: return of("offset", "ms");
    case Change::What::max_age: return of("max_age", "ms");
    case Change::What::cores: break;
  }
  return fmt::format("give it {:.0f} cores instead of {:.0f}", change.to, change.from);
}

}  // namespace takt::graph
