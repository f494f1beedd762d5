// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/watchdog.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <utility>

#include "rt/sched/bandwidth.hpp"

namespace takt {
namespace {
constexpr int64_t kStallGrain_ns = 5'000'000;  // between two looks at a job that the host may hold up
}  // namespace

Watchdog::Watchdog(const Plan& plan, RunBoard& board, const Clock& clock, std::vector<Worker> workers,
                   const Options& options)
    : plan_(plan),
      board_(board),
      clock_(clock),
      options_(options),
      loss_(options.granted == Policy::deadline ? "it slept as it was taken out of its reservation, which may be lost; "
                                                  "takt doctor tells, this ends it: " +
                                                      recount_command()
                                                : ""),
      watched_(workers.size()),
      stolen_(options.stolen_ns) {
  for (size_t w = 0; w < workers.size(); ++w) {
    Watched& watched = watched_[w];
    for (const size_t task : workers[w].tasks) {
      const WatchRules rules = watch_rules(plan.tasks[task], options.granted, options.patience_ns);
      watched.rules.push_back(rules);
      watched.low = watched.low && rules.low;
      if (rules.minds_overrun() && (watched.least_budget_ns == 0 || rules.budget_ns < watched.least_budget_ns))
        watched.least_budget_ns = rules.budget_ns;
    }
    watched.worker = std::move(workers[w]);
    watched.beside = watched.worker.watch->refusals() > 0;
    watched.beside_since_ns = clock.now_ns();
    watched.own_lookout = watched.least_budget_ns > 0 && watched.worker.has.priority > 0;
  }
  Reservation wanted;
  if (options.priority > 0) wanted = fixed_reservation(options.priority);
  lookouts_.push_back(
      std::make_unique<Lookout>("takt-watchdog", wanted, clock, [this](int64_t now_ns) { return look(now_ns); }));
  for (Watched& watched : watched_) {
    if (!watched.own_lookout) continue;
    wanted = watched.worker.has;
    wanted.priority += 1;
    lookouts_.push_back(
        std::make_unique<Lookout>("watch " + plan.tasks[watched.worker.tasks.front()].name, wanted, clock,
                                  [this, &watched](int64_t now_ns) { return look_at_budget(watched, now_ns); }));
    watched.worker.watch->set_lookout(lookouts_.back().get());
  }
}

Watchdog::~Watchdog() {
  for (const Watched& watched : watched_)
    if (watched.own_lookout) watched.worker.watch->set_lookout(nullptr);
  lookouts_.clear();
  for (Watched& watched : watched_) {
    look_for_return(watched, clock_.now_ns());
    if (!watched.beside || !watched.beside_told) continue;
    char what[120];
    std::snprintf(what, sizeof what, "it never had its reservation again; it was refused %" PRIu32 " times",
                  watched.worker.watch->refusals());
    tell_bandwidth(watched.worker.tasks.front(), clock_.now_ns(), what);
  }
}

bool Watchdog::hangs(size_t worker) const {
  const uint64_t told = watched_[worker].hang_told.load();
  return told != 0 && watched_[worker].worker.watch->running().serial == told;
}

int64_t Watchdog::look(int64_t now_ns) {
  int64_t next_ns = Lookout::kNever;
  if (options_.granted == Policy::deadline && stolen_.counted()) {
    stolen_.look(now_ns);
    const bool stolen = stolen_.recent_ns() > 0;
    const bool close = std::any_of(watched_.begin(), watched_.end(), [&](const Watched& watched) {
      const JobWatch& watch = *watched.worker.watch;
      return watch.lifted() || (stolen && watch.running().serial != 0);
    });
    next_ns = now_ns + (close ? kStallGrain_ns : StolenTime::kStep_ns);
  }
  for (Watched& watched : watched_)
    next_ns = std::min({next_ns, look_at(watched, now_ns), look_at_reserve(watched, now_ns)});
  if (options_.life != nullptr) {
    options_.life->heartbeat_ns.store(now_ns, std::memory_order_relaxed);
    next_ns = std::min(next_ns, now_ns + options_.heartbeat_period_ns);
  }
  return next_ns;
}

WatchSight Watchdog::sight_of(const JobWatch& watch, const JobWatch::Running& job, int64_t now_ns) {
  WatchSight sight;
  sight.now_ns = now_ns;
  sight.running = job.serial != 0;
  sight.release_ns = sight.running ? job.release_ns : watch.expected_ns();
  sight.overrun_told = sight.running && job.acted;
  return sight;
}

int64_t Watchdog::look_at(Watched& watched, int64_t now_ns) {
  const JobWatch& watch = *watched.worker.watch;
  const JobWatch::Running job = watch.running();
  WatchSight sight = sight_of(watch, job, now_ns);
  const auto judge_it = [&](const WatchRules& rules) {
    return watched.own_lookout ? judge_clock(rules, sight) : judge(rules, sight);
  };
  if (!sight.running) {
    int64_t next_ns = Lookout::kNever;
    for (const WatchRules& rules : watched.rules) next_ns = std::min(next_ns, judge_it(rules).look_again_ns);
    return next_ns;
  }
  const WatchRules& rules = watched.rules[job.member];
  sight.miss_told = watched.miss_told == job.serial;
  sight.hang_told = watched.hang_told.load() == job.serial;
  sight.stolen_ns = rules.lift ? stolen_.recent_ns() : 0;
  sight.lifted = watch.lifted();
  sight.first = sight.lifted && watch.first();
  sight.ordinary = sight.lifted && watch.ordinary();
  sight.owed_ns = watch.owed_ns(now_ns);
  const bool may_lift = sight.stolen_ns > 0 && now_ns > job.release_ns + rules.deadline_ns;
  const bool budget = rules.minds_overrun() && !job.acted && !watched.own_lookout;
  if (budget || may_lift || sight.lifted) {
    const int64_t used_ns = watch.cpu_ns();
    sight.cpu_left_ns = used_ns < 0 ? 0 : job.cpu_limit_ns - used_ns;
    sight.stands = used_ns == watched.seen_cpu_ns;
    watched.seen_cpu_ns = used_ns;
  }
  const WatchVerdict verdict = judge_it(rules);
  act(watched, job, verdict, now_ns);
  // Acted on: what comes next is known only at another look.
  if (verdict.overrun || verdict.miss || verdict.hang) return now_ns + kWatchGrain_ns;
  const bool others = !watched.own_lookout && watched.least_budget_ns > 0 && !rules.minds_overrun();
  if (!others || sight.hang_told) return verdict.look_again_ns;
  // Another member of the lane may begin any moment.
  return std::min(verdict.look_again_ns, now_ns + std::max(watched.least_budget_ns, kStandsGrain_ns));
}

int64_t Watchdog::look_at_budget(Watched& watched, int64_t now_ns) {
  const JobWatch& watch = *watched.worker.watch;
  const JobWatch::Running job = watch.running();
  WatchSight sight = sight_of(watch, job, now_ns);
  if (!sight.running) {
    int64_t next_ns = Lookout::kNever;
    for (const WatchRules& rules : watched.rules) next_ns = std::min(next_ns, judge_budget(rules, sight).look_again_ns);
    return next_ns;
  }
  if (job.acted) return Lookout::kNever;  // its end wakes this thread
  const WatchRules& rules = watched.rules[job.member];
  // Another member of the lane may begin any moment.
  if (!rules.minds_overrun()) return now_ns + std::max(watched.least_budget_ns, kWatchGrain_ns);
  const int64_t used_ns = watch.cpu_ns();
  sight.cpu_left_ns = used_ns < 0 ? 0 : job.cpu_limit_ns - used_ns;
  sight.now_ns = clock_.now_ns();  // what the look took so far is no time of the job's
  const WatchVerdict verdict = judge_budget(rules, sight);
  if (!verdict.overrun) return verdict.look_again_ns;
  overrun(watched, job, now_ns);
  return now_ns + kWatchGrain_ns;
}

int64_t Watchdog::look_at_reserve(Watched& watched, int64_t now_ns) {
  const JobWatch& watch = *watched.worker.watch;
  if (watch.runtime_ns() <= 0) return std::numeric_limits<int64_t>::max();
  const JobWatch::Running job = watch.running();
  ReserveSight sight;
  sight.now_ns = now_ns;
  const size_t member = job.serial != 0 ? job.member : 0;
  sight.release_ns = job.serial != 0 ? job.release_ns : watch.expected_ns();
  sight.deadline_ns = watched.rules[member].deadline_ns;
  sight.runtime_ns = watch.runtime_ns();
  sight.period_ns = watch.period_ns();
  sight.lifted = watch.lifted() && !watch.returns();
  sight.low = watched.low;
  if (!sight.lifted && now_ns >= sight.release_ns + sight.runtime_ns) {
    const int64_t cpu_ns = watch.cpu_ns();
    sight.left_ns = watch.reserve_end_ns() - cpu_ns;
    sight.owed_ns = watch.owed_ns(now_ns);
    sight.stands = cpu_ns == watched.overdrawn_cpu_ns;
    watched.overdrawn_cpu_ns = sight.used_up() ? cpu_ns : 0;
    // Where the host stopped all of this, the time in between says nothing.
    const int64_t watched_ns = std::min(now_ns - std::max(watched.stood_at_ns, sight.release_ns), kReserveRest_ns);
    watched.stood_ns = cpu_ns == watched.stood_cpu_ns ? watched.stood_ns + std::max<int64_t>(watched_ns, 0) : 0;
    watched.stood_cpu_ns = cpu_ns;
    watched.stood_at_ns = now_ns;
    sight.stood_ns = watched.stood_ns;
  }
  if (watched.beside) look_for_return(watched, now_ns);
  const ReserveVerdict verdict = judge_reserve(sight);
  const size_t task = watched.worker.tasks[member];
  if (verdict.lift) lift(watched, task, sight.owed_ns - sight.left_ns, now_ns, watched.low);
  if (verdict.rescue) rescue(watched, task, now_ns);
  return verdict.look_again_ns;
}

void Watchdog::overrun(Watched& watched, const JobWatch::Running& job, int64_t now_ns) {
  const WatchRules& rules = watched.rules[job.member];
  const size_t task = watched.worker.tasks[job.member];
  JobWatch& watch = *watched.worker.watch;
  const bool demoted = rules.demote && watch.demote(job.serial);
  if (demoted) {
    TaskStatistics& statistics = board_.task(task);
    statistics.demoted.fetch_add(1, std::memory_order_relaxed);
    const int64_t error_ns = std::max(statistics.enforcement_error_ns.load(), watch.cpu_ns() - job.cpu_limit_ns);
    statistics.enforcement_error_ns.store(error_ns, std::memory_order_relaxed);
  }
  if ((demoted || watch.tell(job.serial)) && rules.stop_on_overrun)
    safe_stop(task, job.index, "budget used up", now_ns);
}

void Watchdog::act(Watched& watched, const JobWatch::Running& job, const WatchVerdict& verdict, int64_t now_ns) {
  const size_t task = watched.worker.tasks[job.member];
  if (verdict.overrun) overrun(watched, job, now_ns);
  if (const JobWatch& watch = *watched.worker.watch; verdict.lift)
    lift(watched, task, watch.owed_ns(now_ns) + std::max<int64_t>(0, watch.cpu_ns() - job.cpu_limit_ns), now_ns,
         /*behind=*/false);
  if (verdict.drop) watched.worker.watch->drop();
  if (verdict.miss) {
    watched.miss_told = job.serial;
    safe_stop(task, job.index, "deadline passed", now_ns);
  }
  if (verdict.hang) {
    watched.hang_told.store(job.serial);
    hang(watched, job, now_ns);
  }
}

void Watchdog::hang(Watched& watched, const JobWatch::Running& job, int64_t now_ns) {
  const size_t task = watched.worker.tasks[job.member];
  if (options_.granted == Policy::fixed) {
    // It would keep its core from all others of lower priority for ever. Others of its lane wait for it in any case.
    if (watched.worker.watch->demote(job.serial)) board_.task(task).demoted.fetch_add(1, std::memory_order_relaxed);
    const bool stops = !watched.low && options_.life == nullptr && plan_.safe_stop != kNone;
    tell_hang(task, job, now_ns, stops ? "; it is demoted, and safe_stop entered" : "; it is demoted");
    if (stops) safe_stop(task, job.index, "hangs", now_ns);
    return;
  }
  const bool ends_run = options_.granted == Policy::cooperative && options_.life == nullptr;
  const Fault fault = tell_hang(task, job, now_ns, ends_run ? "; without real-time policies that ends the run" : "");
  if (!ends_run) return;  // no writing here: a full pipe would stop all enforcement
  std::fprintf(stderr, "takt: error: %s\n", std::string(fault.what.text()).c_str());
  board_.stop().raise(now_ns);
}

void Watchdog::lift(Watched& watched, size_t task, int64_t owed_ns, int64_t now_ns, bool behind) {
  const JobWatch::Lift lifted = watched.worker.watch->lift(now_ns, owed_ns, behind);
  if (lifted == JobWatch::Lift::refused) return;
  board_.task(task).lifted.fetch_add(1, std::memory_order_relaxed);
  if (lifted == JobWatch::Lift::slept && !std::exchange(watched.loss_told, true))
    tell_bandwidth(task, now_ns, loss_.c_str());
}

void Watchdog::rescue(Watched& watched, size_t task, int64_t now_ns) {
  const int64_t stood_ns = std::exchange(watched.stood_ns, 0);
  if (watched.worker.watch->rescue(now_ns, watched.low) == JobWatch::Lift::refused) return;
  board_.task(task).lifted.fetch_add(1, std::memory_order_relaxed);
  char what[120];
  std::snprintf(what, sizeof what, "the kernel did not run it for %" PRId64 " ms; it goes on beside its reservation",
                stood_ns / 1'000'000);
  tell_bandwidth(task, now_ns, what);
}

void Watchdog::look_for_return(Watched& watched, int64_t now_ns) {
  const JobWatch& watch = *watched.worker.watch;
  if (!watched.beside || watch.returns()) return;
  const int64_t ms = (now_ns - watched.beside_since_ns) / 1'000'000;
  const size_t head = watched.worker.tasks.front();
  char what[160];
  if (watch.lifted()) {
    const int64_t usual_ms = (watch.period_ns() + kBandwidthMargin_ns) / 1'000'000;  // as its predecessor gave it back
    if (watched.beside_told || ms <= usual_ms) return;
    watched.beside_told = true;
    std::snprintf(what, sizeof what,
                  "its reservation is not free %" PRId64
                  " ms after the restart; its jobs run beside it under "
                  "SCHED_FIFO, and it asks again after each",
                  ms);
    return tell_bandwidth(head, now_ns, what);
  }
  watched.beside = false;
  for (const size_t task : watched.worker.tasks) board_.set_grant(task, watch.grant());
  if (!watched.beside_told) return;
  std::snprintf(what, sizeof what, "it has its reservation after %" PRId64 " ms; it was refused %" PRIu32 " times", ms,
                watch.refusals());
  tell_bandwidth(head, now_ns, what);
}

void Watchdog::tell_bandwidth(size_t task, int64_t now_ns, const char* what) {
  Fault fault;
  fault.kind = Fault::bandwidth;
  fault.task = static_cast<uint32_t>(task);
  fault.at_ns = now_ns;
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(), "%s: %s", plan_.tasks[task].name.c_str(),
                what);
  board_.faults().append(fault);
}

void Watchdog::safe_stop(size_t task, uint64_t job, const char* why, int64_t now_ns) {
  char reason[120];
  std::snprintf(reason, sizeof reason, "%s: %s, job %" PRIu64 " still running", plan_.tasks[task].name.c_str(), why,
                job);
  board_.safe_stop(now_ns + ModeLog::kLead_ns, reason);
}

Fault Watchdog::tell_hang(size_t task, const JobWatch::Running& job, int64_t now_ns, const char* consequence) {
  Fault fault;
  fault.kind = Fault::hang;
  fault.task = static_cast<uint32_t>(task);
  fault.job = job.index;
  fault.at_ns = now_ns;
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(),
                "%s: job %" PRIu64 " has not returned %" PRId64 " ms after its release%s",
                plan_.tasks[task].name.c_str(), job.index, (now_ns - job.release_ns) / 1'000'000, consequence);
  board_.faults().append(fault);
  if (options_.life != nullptr) {
    options_.life->hanging_since_ns.store(job.release_ns);
    options_.life->hanging.store(static_cast<uint32_t>(task) + 1);
  }
  return fault;
}

}  // namespace takt
