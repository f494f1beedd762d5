// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/supervisor.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <utility>

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
  }
}

void Supervisor::look() {
  board_.modes().gather();
  const int64_t now_ns = clock_.now_ns();
  while (const auto end = group_.reap()) note_end(*end, now_ns);
  if (const size_t lost = group_.lost_nurseries(); lost != lost_nurseries_) {
    lost_nurseries_ = lost;
    if (options_.say) options_.say("the process that starts others again was lost; its spare takes its place");
  }
  if (ending_) return;
  for (size_t p = 0; p < members_.size(); ++p) {
    Member& member = members_[p];
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
  lost_cpu_ns_ += end.cpu_ns;
  if (end.signal != 0 && options_.clean_up) options_.clean_up(end.pid);
  const int64_t from_ns = member.killed_for.empty() ? now_ns : member.away_since_ns;
  const std::string cause = text_of(end) + std::exchange(member.killed_for, "");
  board_.lose_sources(member.tasks, now_ns, now_ns + ModeLog::kLead_ns);
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

void Supervisor::plan_start(size_t process, int64_t now_ns, const std::string& cause) {
  const auto again = members_[process].policy.ended(now_ns);
  if (!again) return give_up(process, now_ns, cause);
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
  const Member& member = members_[process];
  const bool high = std::any_of(member.tasks.begin(), member.tasks.end(),
                                [&](size_t t) { return plan_.tasks[t].criticality == Criticality::high; });
  if (high) board_.safe_stop(now_ns + ModeLog::kLead_ns, "process " + group_.name(process) + " was given up");
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
  outage.started = group_.restart(process);
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
    outage.back_ns = now_ns;
    member.outage = kNoOutage;
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
  if (const uint32_t hanging = life.hanging.load(); hanging > 0 && hanging <= plan_.tasks.size())
    return end(process, life.hanging_since_ns.load(),
               ", because a job of " + plan_.tasks[hanging - 1].name + " did not return");
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
