// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/supervisor.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <csignal>
#include <cstring>
#include <utility>

#include "rt/node.hpp"
#include "rt/sched/lane_tasks.hpp"

namespace takt {
namespace {

std::string text_of(const ProcessGroup::End& end) {
  if (end.signal == 0) return "ended with code " + std::to_string(end.code);
  return "was ended by signal " + std::to_string(end.signal) + " (" + strsignal(end.signal) + ")";
}

std::string seconds(int64_t ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f s", static_cast<double>(ns) / 1e9);
  return text;
}

}  // namespace

Supervisor::Supervisor(const Plan& plan, RunBoard& board, ProcessGroup& group, Transport& transport, const Clock& clock,
                       std::vector<std::vector<size_t>> tasks_of, Options options)
    : plan_(plan),
      board_(board),
      group_(group),
      transport_(transport),
      clock_(clock),
      options_(std::move(options)),
      outages_(board.outages()) {
  for (std::vector<size_t>& tasks : tasks_of) {
    Member& member = members_.emplace_back();
    member.tasks = std::move(tasks);
    member.policy = RestartPolicy(options_.restarts);
    member.policy.started(clock.now_ns());
    const size_t process = members_.size() - 1;
    member.spare.use.wanted = process < options_.spares.size() && options_.spares[process];
    member.spare.policy = RestartPolicy(options_.restarts);
    member.spare.next_ns = clock.now_ns() + options_.spare_delay_ns;
  }
}

void Supervisor::let_end() {
  ending_ = true;
  for (size_t p = 0; p < members_.size(); ++p) {
    const int64_t cpu_ns = group_.spare_cpu_ns(p);
    members_[p].spare.use.cpu_ns += cpu_ns;
    lost_cpu_ns_ += cpu_ns;
    group_.end_spare(p);
  }
}

void Supervisor::look() {
  board_.modes().gather();
  const int64_t now_ns = clock_.now_ns();
  while (const auto end = group_.reap()) {
    if (end->of == ProcessGroup::End::member) note_end(*end, now_ns);
    else if (end->of == ProcessGroup::End::cleared) note_cleared(*end);
    else note_spare_end(*end, now_ns);
  }
  if (const size_t lost = group_.lost_nurseries(); lost != lost_nurseries_) {
    lost_nurseries_ = lost;
    if (options_.say) options_.say("the process that starts others again was lost; its spare takes its place");
  }
  if (ending_) return;
  for (size_t p = 0; p < members_.size(); ++p) {
    Member& member = members_[p];
    if (member.spare.use.wanted) watch_spare(p, now_ns);
    // One that has a spare is not waited for until the kernel has cleared it up.
    if (const auto dead = spare_is_ready(p) ? group_.early_end(p) : std::nullopt) note_end(*dead, now_ns);
    if (member.outage == kNoOutage) {
      watch_life(p, now_ns);
      continue;
    }
    const Outage& outage = outages_[member.outage];
    if (outage.started) watch_return(p, now_ns);
    else if (outage.start_ns > 0 && now_ns >= outage.start_ns) start_again(p, now_ns);
  }
}

void Supervisor::note_end(const ProcessGroup::End& end, int64_t now_ns) {
  const bool finished = board_.process(end.process).state.load() == ProcessRecord::finished;
  if (end.code == 0 && (finished || ending_)) return;
  Member& member = members_[end.process];
  lost_cpu_ns_ += end.cpu_ns;  // none of one that is still being cleared up: note_cleared()
  if (end.signal != 0 && options_.clean_up) options_.clean_up(end.pid);
  const int64_t from_ns = member.killed_for.empty() ? now_ns : member.away_since_ns;
  const std::string cause = text_of(end) + std::exchange(member.killed_for, "");
  board_.lose_sources(member.tasks, now_ns, now_ns + ModeLog::kLead_ns);
  if (std::exchange(member.hung, false) || (end.signal != 0 && end.signal != SIGKILL))
    judge_crash(end.process, from_ns, now_ns);
  for (const size_t t : member.tasks) board_.task(t).in_job.store(0);
  if (member.outage == kNoOutage) {
    Outage outage;
    outage.process = static_cast<uint32_t>(end.process);
    outage.cause = BoundedText<200>(cause);
    outage.from_ns = from_ns;
    member.outage = outages_.add(outage);
  }  // else it has died again before it was back: the outage goes on
  Outage& outage = outages_[member.outage];
  outage.freed += transport_.reclaim(static_cast<uint32_t>(end.process) + 1);
  outage.started = false;
  outage.start_ns = 0;
  if (!ending_) plan_start(end.process, now_ns, cause);
}

std::vector<Supervisor::Suspect> Supervisor::in_hand(const Member& member) {
  std::vector<Suspect> suspects;
  for (const size_t t : member.tasks) {
    if (board_.task(t).in_job.load() == 0) continue;
    for (size_t e = 0; e < plan_.tasks[t].edges.size(); ++e) {
      const EdgeStatistics& edge = board_.edge(t, e);
      const Suspect fresh{t, e, std::max(edge.last_seen, edge.pass_over_to.load()) + 1, edge.in_hand.load()};
      if (fresh.from <= fresh.to) suspects.push_back(fresh);
    }
  }
  return suspects;
}

void Supervisor::judge_crash(size_t process, int64_t ended_ns, int64_t now_ns) {
  Member& member = members_[process];
  const std::vector<Suspect> before = std::exchange(member.suspects, in_hand(member));
  const std::vector<Suspect> passed = std::exchange(member.passed_over, {});
  if (ended_ns - board_.process(process).reached_ns[ProcessRecord::running].load() >
      options_.silence_ns + options_.poison_ns)
    return;
  const auto of_same_input = [](const Suspect& a) {
    return [&](const Suspect& b) { return a.task == b.task && a.edge == b.edge; };
  };
  for (const Suspect& now : member.suspects) {
    if (std::any_of(passed.begin(), passed.end(), of_same_input(now)))
      return board_.safe_stop(now_ns + ModeLog::kLead_ns,
                              "process " + group_.name(process) + " ended on one message after the other");
    const auto was = std::find_if(before.begin(), before.end(), of_same_input(now));
    if (was == before.end() || was->from > now.to || now.from > was->to) continue;
    member.passed_over.push_back({now.task, now.edge, std::max(was->from, now.from), std::min(was->to, now.to)});
    pass_over(process, member.passed_over.back(), now_ns);
  }
}

void Supervisor::pass_over(size_t process, const Suspect& messages, int64_t now_ns) {
  const TaskPlan& task = plan_.tasks[messages.task];
  const EdgePlan& edge = task.edges[messages.edge];
  EdgeStatistics& statistics = board_.edge(messages.task, messages.edge);
  statistics.pass_over_from.store(messages.from);
  statistics.pass_over_to.store(messages.to);
  statistics.passed_over.fetch_add(messages.to - messages.from + 1);
  Fault fault;
  fault.kind = Fault::poison;
  fault.task = static_cast<uint32_t>(messages.task);
  fault.at_ns = now_ns;
  const PortPlan& port = plan_.ports[edge.port];
  const std::string_view input = task.node->inputs()[edge.input]->name();
  const std::string which = messages.from == messages.to
                                ? "message " + std::to_string(messages.from)
                                : "messages " + std::to_string(messages.from) + " to " + std::to_string(messages.to);
  std::snprintf(fault.what.characters.data(), fault.what.characters.size(),
                "%s.%.*s: process %s ended twice on %s of %s.%s, which it does not get again", task.name.c_str(),
                static_cast<int>(input.size()), input.data(), group_.name(process).c_str(), which.c_str(),
                port.node.c_str(), port.port.c_str());
  board_.faults().append(fault);
  if (options_.say) options_.say(std::string(fault.what.text()));
}

void Supervisor::note_cleared(const ProcessGroup::End& end) {
  lost_cpu_ns_ += end.cpu_ns;
  if (end.signal != 0 && options_.clean_up) options_.clean_up(end.pid);
}

void Supervisor::note_spare_end(const ProcessGroup::End& end, int64_t now_ns) {
  Member::Spare& spare = members_[end.process].spare;
  if (ending_) return;
  spare.use.cpu_ns += end.cpu_ns;
  lost_cpu_ns_ += end.cpu_ns;
  spare.use.ready = false;
  if (members_[end.process].given_up) return;
  ++spare.use.lost;
  const auto again = spare.policy.ended(now_ns);
  spare.next_ns = again.value_or(INT64_MAX);
  if (options_.say)
    options_.say("the spare of process " + group_.name(end.process) + " " + text_of(end) +
                 (again ? "; there will be another one" : "; there will be no other one"));
}

bool Supervisor::spare_is_ready(size_t process) {
  const pid_t spare = group_.spare(process);
  return spare > 0 && board_.spare(process).ready.load() == spare;
}

SpareUse Supervisor::spare_use(size_t process) const { return members_[process].spare.use; }

void Supervisor::watch_spare(size_t process, int64_t now_ns) {
  Member& member = members_[process];
  Member::Spare& spare = member.spare;
  if (group_.spare(process) == 0) {
    spare.use.ready = false;
    if (member.outage != kNoOutage || now_ns < spare.next_ns) return;
    board_.spare_order(process).takes_over.store(0);  // numbers of processes come again
    board_.spare(process).ready.store(0);
    if (!group_.start_spare(process)) return;
    spare.started_ns = now_ns;
    spare.policy.started(now_ns);
  } else if (!spare.use.ready && spare_is_ready(process)) {
    spare.use.ready = true;
    spare.use.ready_within_ns = std::max(spare.use.ready_within_ns, now_ns - spare.started_ns);
    if (options_.memory_mb) spare.use.memory_mb = options_.memory_mb(group_.spare(process));
  } else if (!spare.use.ready && now_ns - spare.started_ns > options_.spare_patience_ns) {
    group_.end_spare(process);
  }
}

bool Supervisor::take_over(size_t process) {
  Member::Spare& spare = members_[process].spare;
  if (!spare.use.wanted) return false;
  if (!spare_is_ready(process)) return ++spare.use.not_ready, false;
  spare.use.cpu_ns += group_.spare_cpu_ns(process);
  ++spare.use.takeovers;
  group_.take_over(process);
  std::atomic<int32_t>& order = board_.spare_order(process).takes_over;
  order.store(group_.pid(process));
  syscall(SYS_futex, &order, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  return true;
}

void Supervisor::plan_start(size_t process, int64_t now_ns, const std::string& cause) {
  auto again = members_[process].policy.ended(now_ns);
  if (!again) return give_up(process, now_ns, cause);
  // A spare has cost already what a wait is to keep from others; there is no other one before this one has come back.
  if (spare_is_ready(process)) again = now_ns;
  outages_[members_[process].outage].start_ns = *again;
  if (options_.say)
    options_.say("process " + group_.name(process) + " " + cause + "; it is started again" +
                 (*again > now_ns ? " in " + seconds(*again - now_ns) : ""));
}

void Supervisor::all_were_lost(const GroupSigns::Loss& loss) {
  for (size_t p = 0; p < members_.size(); ++p) {
    Member& member = members_[p];
    Outage outage;
    outage.process = static_cast<uint32_t>(p);
    outage.cause = loss.cause;
    outage.from_ns = loss.from_ns;
    for (size_t i = 0; i < outages_.size(); ++i)  // it was away already
      if (outages_[i].process == p && outages_[i].back_ns == 0) member.outage = i;
    if (member.outage == kNoOutage) member.outage = outages_.add(outage);
    Outage& away = outages_[member.outage];
    if (away.from_ns != loss.from_ns)
      away.cause = BoundedText<200>(std::string(away.cause.text()) + "; then " + std::string(loss.cause.text()));
    away.start_ns = clock_.now_ns();
    away.started = true;
    for (const size_t t : member.tasks) member.releases_before.push_back(releases_seen(t));
  }
}

void Supervisor::give_up(size_t process, int64_t now_ns, const std::string& cause) {
  gave_up_ = true;
  members_[process].given_up = true;
  group_.end_spare(process);
  if (any_high(plan_, members_[process].tasks))
    board_.safe_stop(now_ns + ModeLog::kLead_ns, "process " + group_.name(process) + " was given up");
  if (options_.say)
    options_.say("process " + group_.name(process) + " " + cause + " for the " +
                 std::to_string(options_.restarts.most_in_window) + "th time within " +
                 seconds(options_.restarts.window_ns) + "; it is given up");
}

void Supervisor::start_again(size_t process, int64_t now_ns) {
  Member& member = members_[process];
  ProcessRecord& record = board_.process(process);
  record.state.store(ProcessRecord::starting);
  record.life.heartbeat_ns.store(0);
  record.life.hanging.store(0);
  record.restarts.fetch_add(1);
  member.releases_before.clear();
  for (const size_t t : member.tasks) member.releases_before.push_back(releases_seen(t));
  member.silence = {};
  Outage& outage = outages_[member.outage];
  outage.by_spare = take_over(process);
  outage.started = outage.by_spare || group_.restart(process);
  outage.start_ns = outage.started ? now_ns : 0;
  member.policy.started(now_ns);
  if (!outage.started) plan_start(process, now_ns, "could not be started again");
}

uint64_t Supervisor::releases_seen(size_t task) const {
  return board_.task(task).job_count.load() + board_.task(task).paused.load();
}

bool Supervisor::all_ran(const Member& member) const {
  const uint32_t mode = board_.mode_at(clock_.now_ns());
  for (size_t i = 0; i < member.tasks.size(); ++i) {
    const size_t t = member.tasks[i];
    const bool waits = !plan_.tasks[t].rate || (mode < plan_.modes.size() && !plan_.modes[mode].runs[t]);
    if (!waits && releases_seen(t) <= member.releases_before[i]) return false;
  }
  return true;
}

void Supervisor::watch_return(size_t process, int64_t now_ns) {
  Member& member = members_[process];
  Outage& outage = outages_[member.outage];
  const bool running = board_.process(process).state.load() >= ProcessRecord::running;
  if (running && all_ran(member)) {
    const auto& reached_ns = board_.process(process).reached_ns;
    outage.composed_ns = reached_ns[ProcessRecord::composed].load();
    outage.joined_ns = reached_ns[ProcessRecord::joined].load();
    outage.running_ns = reached_ns[ProcessRecord::running].load();
    outage.back_ns = now_ns;
    member.outage = kNoOutage;
    member.spare.next_ns = std::max(member.spare.next_ns, now_ns + options_.spare_delay_ns);
    member.silence = {};
    if (options_.say)
      options_.say("process " + group_.name(process) + " is back after " + seconds(now_ns - outage.from_ns));
  } else if (now_ns - outage.start_ns > options_.start_patience_ns) {
    end(process, now_ns, ", because it did not come back within " + seconds(options_.start_patience_ns));
    outage.start_ns = now_ns;
  } else if (const LifeSigns& life = board_.process(process).life; life.hanging.load() > 0) {
    watch_life(process, now_ns);
    // Before it has a watchdog that tells of it, it lives as long as it uses CPU time.
  } else if (member.silence.look(life.heartbeat_ns.load() + group_.cpu_ns(process), now_ns) > options_.silence_ns) {
    end(process, now_ns, ", because it stood still on its way back for " + seconds(options_.silence_ns));
  }
}

void Supervisor::watch_life(size_t process, int64_t now_ns) {
  Member& member = members_[process];
  const LifeSigns& life = board_.process(process).life;
  if (const uint32_t hanging = life.hanging.load(); hanging > 0 && hanging <= plan_.tasks.size()) {
    member.hung = true;
    return end(process, life.hanging_since_ns.load(),
               ", because a job of " + plan_.tasks[hanging - 1].name + " did not return");
  }
  const int64_t heartbeat_ns = life.heartbeat_ns.load();
  if (member.silence.look(heartbeat_ns, now_ns) > options_.silence_ns)
    end(process, heartbeat_ns, ", because it gave no sign of life for " + seconds(options_.silence_ns));
}

void Supervisor::end(size_t process, int64_t since_ns, const std::string& why) {
  if (group_.pid(process) == 0 || !members_[process].killed_for.empty()) return;
  members_[process].killed_for = why;
  members_[process].away_since_ns = since_ns;
  kill(group_.pid(process), SIGKILL);
  const int64_t now_ns = clock_.now_ns();  // beside a CPU hog the kernel may take seconds to clear it up
  board_.lose_sources(members_[process].tasks, now_ns, now_ns + ModeLog::kLead_ns);
}

}  // namespace takt
