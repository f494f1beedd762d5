// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/task.hpp"

#include <sched.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <span>
#include <utility>

#include "rt/hot.hpp"
#include "rt/msg/requests.hpp"
#include "rt/sched/param_mail.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/sched/watch_rules.hpp"
#include "rt/trace/rings.hpp"

namespace takt {
namespace {
constexpr uint64_t kWarmUpJobs = 3;  // they may set up what later ones use

/// The levels that the controller may choose from.
std::span<const QualityLevel> levels_of(const TaskPlan& plan) {
  return std::span(plan.node->levels()).first(plan.on_overrun == OnOverrun::degrade ? plan.node->levels().size() : 1);
}

}  // namespace

void TaskStatistics::add_lateness(int64_t ns) {
  const uint64_t index = lateness.count();
  if (index < kWindow) first_[index] = ns;
  last_[index % kWindow] = ns;
  lateness.add(ns);
}

double TaskStatistics::drift_us() const {
  const auto filled = static_cast<ptrdiff_t>(std::min<uint64_t>(lateness.count(), kWindow));
  if (filled == 0) return 0;
  const int64_t early = *std::min_element(first_.begin(), first_.begin() + filled);
  const int64_t late = *std::min_element(last_.begin(), last_.begin() + filled);
  return static_cast<double>(late - early) / 1e3;
}

Task::Task(const Plan& plan, size_t index, Transport& transport, const Clock& clock, RunBoard& board)
    : plan_(plan.tasks[index]),
      clock_(clock),
      modelled_(clock.is_virtual()),
      board_(board),
      index_(index),
      statistics_(board.task(index)),
      log_(board.log(index)),
      commits_(board.commits(index)),
      latch_(plan_, transport, board, index, clock),
      quality_(levels_of(plan_), plan_.budget_ns, plan_.deadline_ns),
      published_(plan_.ports.size()),
      sequences_(plan_.ports.size()),
      sent_stamps_ns_(plan_.ports.size(), kNothingSent) {
  calls_.node = plan_.name.c_str();
  calls_.counts = statistics_.rt_violations.data();
  calls_.allowed = plan_.node->allowed_calls();
  calls_.strict = strict_job_calls();
  calls_.heap_limit = plan_.memory_bytes;
  for (const ModePlan& mode : plan.modes) modes_.push_back({mode.name, mode.runs[index] != 0});
  if (modes_.empty()) modes_.push_back({plan.mode, true});
  // What a task of this name that died had not settled, so that nobody meets two unsettled commits.
  const CommitRing::Filled left = commits_.recover(clock_);
  spoiled_told_ = commits_.spoiled();
  for (size_t i = 0; i < plan_.ports.size(); ++i) {
    writers_.push_back(transport.make_writer(plan_.ports[i]));
    writers_.back()->settle(left.published_ns, left.visible_at_ns);
    sequences_[i] = writers_.back()->go_on_after(board.port(plan_.ports[i]).published.load());
    PortAccess::attach(*plan_.node->outputs()[i], writers_.back().get());
  }
  size_t first = kNone;
  for (const EdgePlan& edge : plan_.edges)
    if (plan_.node->inputs()[edge.input] != plan_.node->control()) first = std::min(first, edge.input);
  if (first != kNone) first_input_ = plan_.node->inputs()[first];
}

Task::~Task() {
  for (OutputPort* output : plan_.node->outputs()) PortAccess::attach(*output, nullptr);
}

void Task::start(int64_t epoch_ns, Transport* restarted) {
  std::vector<std::unique_ptr<Reader>> readers;
  std::vector<Held> held;
  for (size_t i = 0; restarted != nullptr && i < plan_.ports.size(); ++i) {
    readers.push_back(restarted->make_reader(plan_.ports[i]));
    Candidate newest;
    const bool any = readers.back()->list(INT64_MAX, std::span(&newest, 1)) > 0;
    held.push_back(any ? readers.back()->take(newest.sequence) : Held{});
    handed_.push_back(held.back() ? newest.sequence : 0);
    if (held.back()) PortAccess::hand_over(*plan_.node->outputs()[i], held.back().message());
  }
  take_up(board_, index_, *plan_.node);
  restarted_ = restarted != nullptr;
  plan_.node->start(epoch_ns);
  for (size_t i = 0; i < held.size(); ++i) {
    PortAccess::hand_over(*plan_.node->outputs()[i], nullptr);
    readers[i]->release(held[i]);
  }
}

void Task::settle() {
  for (size_t i = 0; i < writers_.size(); ++i) board_.port(plan_.ports[i]).writer = writers_[i]->statistics();
  statistics_.cpu_ns += plan_.node->helper_cpu_ns();
}

TAKT_HOT bool Task::wanted(uint64_t index) const {
  const Requests* requests = plan_.node->control() != nullptr ? plan_.node->control()->newest() : nullptr;
  if (requests == nullptr) return true;
  for (const Request& request : requests->wanted.items()) {
    if (std::strncmp(request.node, plan_.name.c_str(), sizeof request.node) != 0) continue;
    return request.run != 0 && (request.every <= 1 || index % request.every == 0);
  }
  return true;
}

TAKT_HOT void Task::take_mail() {
  ParamMail& mail = board_.mail(index_);
  if (mail.state.load(std::memory_order_acquire) != ParamMail::posted) return;
  if (!deliver(mail, *plan_.node)) return;
  if (trace::on()) trace_param(trace::Kind::param, mail.param, mail);
  keep(board_.kept(index_, mail.param), mail, ended_.started_ns);
  // Last: after a kill at any step before, the next process takes the same mail.
  mail.state.store(ParamMail::taken, std::memory_order_release);
}

TAKT_HOT int64_t Task::begin(uint64_t index, int64_t release_ns, int64_t duration_ns) {
  const int64_t started = clock_.now_ns();
  ended_ = {};
  ended_.index = index;
  ended_.mode = board_.mode_at(release_ns);
  const Mode& mode = modes_[ended_.mode];
  ended_.release_ns = release_ns;
  ended_.started_ns = started;
  if (std::exchange(restarted_, false) && trace::on()) trace_restart();
  take_mail();
  // Which releases a mode leaves out is known from outside, but for those that a producer causes.
  if (!mode.runs) return pass_over(started, !plan_.rate), 0;
  if (plan_.disturbance != nullptr && !plan_.disturbance->admits(release_ns)) return pass_over(started, false), 0;
  // Nothing that follows is looked at before the clock has come to the release (shm/commit_ring.hpp). An exchange, as
  // at the producer's end: the thread sanitizer knows no fences.
  begun_.exchange(index);
  latch_.acquire_requests(release_ns, started);
  if (!wanted(index)) {
    latch_.release();
    return pass_over(started, true), 0;
  }
  calls_.job = index;
  calls_.warm = jobs_run_++ < kWarmUpJobs;
  const JobScope scope(calls_);
  statistics_.in_job.store(index + 1, std::memory_order_relaxed);
  ended_.stale = latch_.acquire(release_ns, started);
  ended_.new_input = first_input_ != nullptr && first_input_->is_new();
  ended_.level = quality_.level();
  if (trace::on()) {
    trace_start();
    trace_inputs();
  }
  const CpuBudget cpu{plan_.budget_ns, last_thread_use_ns(), modelled_ ? nullptr : &thread_cpu_ns};
  Job job(clock_, index, release_ns, release_ns + plan_.deadline_ns, ended_.level, mode.name, cpu);
  job.log_to(log_);
  work(job, release_ns);
  if (plan_.state_every_ns > 0) save_state();
  if (job.result_notice()) tell_notice(job);
  ended_.ran = true;
  ended_.end.end_of_data = job.ended();
  ended_.no_result = job.without_result();
  ended_.source = job.source_report();
  ended_.source_late_ns = job.source_late_ns();
  if (!modelled_) return 0;
  ended_.used = take_thread_use();
  const double cost = plan_.node->levels()[static_cast<size_t>(ended_.level)].cost;
  return ended_.exec_ns = static_cast<int64_t>(static_cast<double>(duration_ns) * cost);
}

TAKT_HOT JobEnd Task::finish(int modelled_cpu) {
  JobEnd& end = ended_.end;
  if (!ended_.ran) return end;
  {
    const JobScope scope(calls_);
    end.finished_ns = clock_.now_ns();
    publish(end, ended_.release_ns + plan_.deadline_ns);
    latch_.release();
    statistics_.in_job.store(0, std::memory_order_relaxed);
  }
  if (calls_.heap_refused > 0) tell_refused_memory();
  ended_.cpu = modelled_ ? modelled_cpu : sched_getcpu();
  const ThreadUse used = take_thread_use();
  ended_.used.cpu_ns += used.cpu_ns;
  ended_.used.allocations += used.allocations;
  if (!modelled_) ended_.exec_ns = used.cpu_ns;
  return end;
}

TAKT_HOT void Task::fetch_ahead() const {
  constexpr size_t kCounters = 512, kNode = 256, kPort = 128;  // bytes that every job touches
  prefetch(this, sizeof *this);
  prefetch(&statistics_, kCounters);
  prefetch(plan_.node, kNode);
  prefetch(&board_.mail(index_), sizeof(ParamMail::state));
  prefetch(modes_.data(), sizeof(Mode));
  for (const InputPort* input : plan_.node->inputs()) prefetch(input, kPort);
  for (const OutputPort* output : plan_.node->outputs()) prefetch(output, kPort);
}

TAKT_HOT void Task::rehearse(int64_t release_ns) const {
  fetch_ahead();
  latch_.rehearse(release_ns);
  prefetch(&commits_, sizeof commits_);
  prefetch(sequences_.data(), sizeof(uint64_t));
  prefetch(sent_stamps_ns_.data(), sizeof(int64_t));
  for (const size_t port : plan_.ports) prefetch(&board_.port(port).published, sizeof(uint64_t));
  for (const auto& writer : writers_) writer->rehearse();
}

void Task::pass_over(int64_t now_ns, bool count) {
  std::fill(published_.begin(), published_.end(), false);
  take_thread_use();  // of no job: the next one need not answer for it
  ended_.paused = count;
  ended_.end.finished_ns = ended_.end.visible_at_ns = now_ns;
}

TAKT_HOT void Task::work(Job& job, int64_t release_ns) {
  if (watch_ != nullptr)
    watch_->begin(member_, job.index(), release_ns, last_thread_use_ns() + enforced_budget_ns(plan_));
  try {
    if (plan_.disturbance != nullptr) plan_.disturbance->before_run(job);
    plan_.node->run(job);
  } catch (const std::exception& problem) {
    tell_exception(job, problem.what());
    job.no_result();
  } catch (...) {
    tell_exception(job, "something that is no std::exception");
    job.no_result();
  }
  if (watch_ != nullptr) watch_->end();
}

/// In the job, so that what it costs is seen and proven with it.
TAKT_HOT void Task::save_state() {
  if (state_is_due()) plan_.node->save_state(ended_.release_ns);
}

Fault Task::fault_now(Fault::Kind kind, uint64_t job) const {
  Fault fault;
  fault.kind = kind;
  fault.task = static_cast<uint32_t>(index_);
  fault.job = job;
  fault.at_ns = clock_.now_ns();
  return fault;
}

void Task::tell_exception(const Job& job, const char* what) {
  Fault fault = fault_now(Fault::exception, job.index());
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(), "%s: job %llu threw: %s",
                plan_.name.c_str(), static_cast<unsigned long long>(job.index()), what);
  board_.faults().append(fault);
}

void Task::tell_notice(const Job& job) {
  const ResultNotice& notice = *job.result_notice();
  Fault fault = fault_now(notice.wrong ? Fault::wrong : Fault::doubtful, job.index());
  const std::string_view why = notice.why.text();
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(), "%s: %.*s", plan_.name.c_str(),
                static_cast<int>(why.size()), why.data());
  board_.faults().append(fault);
}

void Task::tell_refused_memory() {
  const int64_t refused = std::exchange(calls_.heap_refused, INT64_MIN);  // once: never above 0 again
  Fault fault = fault_now(Fault::memory, calls_.job);
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(),
                "%s: job %llu asked for %lld kB more than the %lld kB that the node may have; it got none",
                plan_.name.c_str(), static_cast<unsigned long long>(calls_.job), static_cast<long long>(refused / 1000),
                static_cast<long long>(plan_.memory_bytes / 1000));
  board_.faults().append(fault);
}

void Task::count(uint64_t page_faults) {
  latch_.count();
  statistics_.page_faults += page_faults;
  if (ended_.paused) {
    add(statistics_.paused);
    outcomes_[outcome_count_++ % outcomes_.size()] = {ended_.release_ns, &statistics_.paused, false};
  }
  if (ended_.ran) count_end();
  ended_ = {};
}

void Task::count_end() {
  if (trace::on()) trace_end();
  const JobEnd& end = ended_.end;
  const ThreadUse& used = ended_.used;
  add(statistics_.stale_inputs, ended_.stale);
  if (ended_.new_input) add(statistics_.new_inputs);
  for (size_t i = 0; i < sent_stamps_ns_.size(); ++i)
    if (sent_stamps_ns_[i] != kNothingSent) count_age(plan_.ports[i], end.visible_at_ns, sent_stamps_ns_[i]);
  statistics_.cpu_ns += used.cpu_ns;
  statistics_.allocations += used.allocations;
  if (end.end_of_data) return;
  statistics_.add_lateness(ended_.started_ns - ended_.release_ns);
  const int64_t exec_ns = ended_.exec_ns;
  statistics_.exec.add(exec_ns);
  statistics_.last_exec_ns.store(exec_ns, std::memory_order_relaxed);
  statistics_.preempted_ns += std::max<int64_t>(0, end.finished_ns - ended_.started_ns - exec_ns);
  statistics_.publish.add(ended_.publish_took_ns);
  const int64_t response = ended_.published_ns - ended_.release_ns;
  statistics_.response.add(response);
  statistics_.response_bound.compare(
      {Excess::response, static_cast<uint32_t>(index_), 0, ended_.published_ns, response}, board_.excesses());
  statistics_.last_response_ns.store(response, std::memory_order_relaxed);
  keep_largest(statistics_.largest_response_ns, response);
  const bool over_budget = plan_.budget_ns > 0 && exec_ns > plan_.budget_ns;
  if (over_budget) add(statistics_.budget_overruns);
  if (over_budget) board_.overruns().append({static_cast<uint32_t>(index_), ended_.release_ns, end.finished_ns});
  if (over_budget && watch_ != nullptr) watch_->overran(exec_ns - plan_.budget_ns, end.finished_ns);
  count_level(response);
  if (ended_.no_result) add(statistics_.no_result);
  if (end.late) add(statistics_.deadline_misses);
  if (end.late && plan_.on_miss == OnMiss::safe_stop) ask_for_safe_stop("deadline missed");
  else if (over_budget && plan_.on_overrun == OnOverrun::safe_stop) ask_for_safe_stop("budget exceeded");
  const int64_t from_ns = end.finished_ns + (modelled_ ? 0 : ModeLog::kLead_ns);
  if (ended_.source) board_.tell_source(index_, ended_.index, *ended_.source, end.finished_ns, from_ns);
  if (ended_.source_late_ns >= LateSource::kShortest_ns)
    board_.late_sources().append({static_cast<uint32_t>(index_), end.finished_ns, ended_.source_late_ns});
  const bool skip = end.late && plan_.on_miss == OnMiss::skip, reuse = end.late && plan_.on_miss == OnMiss::reuse_last;
  std::atomic<uint64_t>& counter = skip ? statistics_.skipped : reuse ? statistics_.reused : statistics_.completed;
  add(counter);
  outcomes_[outcome_count_++ % outcomes_.size()] = {ended_.release_ns, &counter, end.late};
  const uint64_t n = statistics_.job_count.load(std::memory_order_relaxed);
  statistics_.jobs[n % statistics_.jobs.size()] = {ended_.release_ns, ended_.started_ns, end.finished_ns, ended_.cpu};
  statistics_.job_count.store(n + 1, std::memory_order_release);
}

void Task::count_age(size_t port, int64_t visible_at_ns, int64_t stamp_ns) {
  PortStatistics& statistics = board_.port(port);
  const int64_t age_ns = visible_at_ns - stamp_ns;
  statistics.age.add(age_ns);
  statistics.last_age_ns.store(age_ns, std::memory_order_relaxed);
  keep_largest(statistics.largest_age_ns, age_ns);
  statistics.age_bound.compare({Excess::output_age, static_cast<uint32_t>(port), 0, visible_at_ns, age_ns},
                               board_.excesses());
}

void Task::skip(int64_t first, int64_t end, int64_t origin_ns) {
  const Rate& rate = *plan_.rate;
  const auto leave_out = [&](uint32_t mode, int64_t from_ns, int64_t to_ns) {
    if (mode >= modes_.size() || !modes_[mode].runs) return;
    const int64_t from = rate.releases_before(origin_ns, from_ns), to = rate.releases_before(origin_ns, to_ns);
    statistics_.skipped.fetch_add(static_cast<uint64_t>(to - from), std::memory_order_relaxed);
    for (int64_t k = from; trace::on() && k < to; ++k)
      trace::record({rate.release_ns(origin_ns, k), 0, 0, static_cast<uint32_t>(k), static_cast<uint16_t>(index_),
                     trace::Kind::skip, 0});
  };
  board_.modes().for_each_part(rate.release_ns(origin_ns, first), rate.release_ns(origin_ns, end - 1) + 1, leave_out);
}

void Task::ask_for_safe_stop(const char* why) {
  char reason[120];
  std::snprintf(reason, sizeof reason, "%s: %s", plan_.name.c_str(), why);
  const int64_t lead_ns = modelled_ ? 0 : ModeLog::kLead_ns;
  board_.safe_stop(ended_.end.finished_ns + lead_ns, reason);
}

void Task::count_level(int64_t response_ns) {
  add(statistics_.at_level[static_cast<size_t>(ended_.level)]);
  if (statistics_.last_level.load(std::memory_order_relaxed) != ended_.level) {
    const uint64_t n = statistics_.level_changes.load(std::memory_order_relaxed);
    statistics_.changes[n % statistics_.changes.size()] = {ended_.release_ns, ended_.level};
    statistics_.level_changes.store(n + 1, std::memory_order_release);
    statistics_.last_level.store(ended_.level, std::memory_order_relaxed);
    trace::level_change(static_cast<uint16_t>(index_), static_cast<uint32_t>(ended_.index), ended_.level,
                        ended_.started_ns);
  }
  quality_.observe({ended_.release_ns, ended_.exec_ns, response_ns, ended_.no_result});
}

void Task::forget_from(int64_t end_ns) {
  for (Outcome& outcome : outcomes_) {
    if (outcome.counter == nullptr || outcome.release_ns < end_ns) continue;
    outcome.counter->fetch_sub(1);
    if (outcome.late) statistics_.deadline_misses.fetch_sub(1);
    outcome.counter = nullptr;
  }
}

bool Task::published(size_t port) const {
  const auto it = std::find(plan_.ports.begin(), plan_.ports.end(), port);
  return it != plan_.ports.end() && published_[static_cast<size_t>(it - plan_.ports.begin())];
}

}  // namespace takt
