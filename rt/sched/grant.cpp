// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/grant.hpp"

#include <linux/capability.h>
#include <linux/sched.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <optional>

#include "rt/capability.hpp"
#include "rt/thread_state.hpp"

namespace takt {
namespace {

// The C library of Debian 12 has no wrapper and <linux/sched/types.h> clashes with <sched.h>.
struct SchedulingAttributes {
  uint32_t size = sizeof(SchedulingAttributes);
  uint32_t policy = 0;
  uint64_t flags = 0;
  int32_t nice = 0;
  uint32_t priority = 0;
  uint64_t runtime = 0, deadline = 0, period = 0;
};
constexpr uint32_t kDeadline = 6;  // SCHED_DEADLINE
constexpr uint64_t kResetOnFork = 1, kReclaim = 2, kOfCpufreq = 0x10000000;

/// Of the calling thread (0), or another one.
int set_attributes(const SchedulingAttributes& a, int thread = 0) {
  return static_cast<int>(syscall(SYS_sched_setattr, thread, &a, 0));
}
int get_attributes(SchedulingAttributes& a, int thread = 0) {
  return static_cast<int>(syscall(SYS_sched_getattr, thread, &a, sizeof a, 0));
}

std::vector<int> current_cpus(int thread) {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cpus;
  if (sched_getaffinity(thread, sizeof set, &set) != 0) return cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<size_t>(cpu), &set)) cpus.push_back(cpu);
  }
  return cpus;
}

std::string refusal(const char* what, int error) {
  std::string text = std::string(what) + " was refused (" + std::strerror(error) + "); ";
  if (error == EPERM && has_capability(CAP_SYS_NICE))
    return text +
           "this process has the right, so its CPUs are too few (SCHED_DEADLINE takes no affinity: all CPUs, or an "
           "exclusive cpuset) or kernel.sched_rt_runtime_us is 0";
  if (error == EPERM) return text + "run it as the service, as root, or with CAP_SYS_NICE; takt doctor says how";
  if (error == EBUSY) return text + "too much of the CPUs is reserved already";
  return text;
}

bool pin(int core, Grant& grant) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<size_t>(core), &set);
  if (sched_setaffinity(0, sizeof set, &set) == 0) return true;
  grant.error = errno;
  grant.refused = refusal(("CPU " + std::to_string(core)).c_str(), grant.error);
  return false;
}

SchedulingAttributes attributes_of(const Reservation& wanted) {
  SchedulingAttributes a;
  a.policy = kDeadline;
  a.flags = kResetOnFork | (wanted.reclaims ? kReclaim : 0);
  a.runtime = static_cast<uint64_t>(wanted.runtime_ns);
  a.deadline = static_cast<uint64_t>(wanted.deadline_ns);
  a.period = static_cast<uint64_t>(wanted.period_ns);
  return a;
}

bool put_under(int thread, int policy, int priority) {
  const sched_param param{priority};
  return sched_setscheduler(thread, policy | SCHED_RESET_ON_FORK, &param) == 0;
}

Grant apply_deadline(const Reservation& wanted, int64_t patience_ns) {
  const SchedulingAttributes a = attributes_of(wanted);
  int error = 0;
  for (int64_t waited = 0;; waited += kBandwidthStep_ns) {
    error = set_attributes(a) == 0 ? 0 : errno;
    if (error != EBUSY || waited >= patience_ns) break;
    const timespec pause{0, kBandwidthStep_ns};
    nanosleep(&pause, nullptr);
  }
  if (error != 0) {
    Grant grant;
    grant.error = error;
    grant.refused = refusal("SCHED_DEADLINE", error);
    return grant;
  }
  return read_back(wanted);
}

Grant apply_fixed(const Reservation& wanted) {
  Grant grant;
  if (wanted.core >= 0 && !pin(wanted.core, grant)) return grant;
  const sched_param param{wanted.priority};
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) != 0) {
    grant.error = errno;
    grant.refused = refusal("SCHED_FIFO", grant.error);
    return grant;
  }
  return read_back(wanted);
}

Grant apply_cooperative(const Reservation& wanted) {
  Grant grant;
  grant.verified = true;
  if (wanted.slice_ns == 0) return grant;
  SchedulingAttributes a;
  if (get_attributes(a) != 0) return grant;
  a.runtime = static_cast<uint64_t>(wanted.slice_ns);
  set_attributes(a);  // no promise rests on it
  return grant;
}

}  // namespace

Reservation cooperative_reservation() {
  Reservation r;
  r.slice_ns = 100'000;
  return r;
}

Reservation fixed_reservation(int priority, int core) {
  Reservation r;
  r.policy = Policy::fixed;
  r.priority = priority;
  r.core = core;
  return r;
}

Reservation deadline_reservation(int64_t budget_ns, int64_t deadline_ns, int64_t period_ns) {
  Reservation r;
  r.policy = Policy::deadline;
  r.deadline_ns = r.period_ns = deadline_ns < period_ns ? deadline_ns : period_ns / 20 * 19;
  r.runtime_ns = std::min(budget_ns, r.deadline_ns);
  return r;
}

int64_t bandwidth_within_ns(const std::vector<Reservation>& reservations) {
  int64_t longest_ns = 0;
  for (const Reservation& r : reservations)
    if (r.policy == Policy::deadline) longest_ns = std::max(longest_ns, r.period_ns + kBandwidthStep_ns);
  return longest_ns;
}

Grant apply(const Reservation& wanted, int64_t patience_ns) {
  prctl(PR_SET_TIMERSLACK, 1UL);
  Grant grant;
  if (wanted.policy == Policy::deadline) grant = apply_deadline(wanted, patience_ns);
  else if (wanted.policy == Policy::fixed) grant = apply_fixed(wanted);
  else grant = apply_cooperative(wanted);
  grant.cpus = current_cpus(0);
  return grant;
}

Grant read_back(const Reservation& wanted, int thread) {
  Grant grant;
  grant.cpus = current_cpus(thread);
  SchedulingAttributes got;
  if (get_attributes(got, thread) != 0) return grant;
  if (got.policy == kDeadline) {
    const SchedulingAttributes asked = attributes_of(wanted);
    grant.policy = Policy::deadline;
    grant.runtime_ms = static_cast<double>(got.runtime) / 1e6;
    grant.deadline_ms = static_cast<double>(got.deadline) / 1e6;
    grant.verified = wanted.policy == Policy::deadline && got.runtime == asked.runtime &&
                     got.deadline == asked.deadline && got.period == asked.period &&
                     (got.flags & kReclaim) == (asked.flags & kReclaim);
  } else if (got.policy == SCHED_FIFO) {
    grant.policy = Policy::fixed;
    grant.priority = static_cast<int>(got.priority);
    grant.verified =
        grant.priority == wanted.priority && (wanted.core < 0 || grant.cpus == std::vector<int>{wanted.core});
  }
  return grant;
}

bool demote_thread(int thread) { return put_under(thread, SCHED_OTHER, 0); }

bool lift_thread(int thread, int priority) { return put_under(thread, SCHED_FIFO, priority); }

bool take_from_reservation(int thread) {
  if ((sched_getscheduler(thread) & ~SCHED_RESET_ON_FORK) != static_cast<int>(kDeadline)) return false;
  if (!runnable(thread)) return false;
  return lift_thread(thread, kLowestPriority) || demote_thread(thread);
}

std::optional<Reservation> reservation_of(int thread) {
  SchedulingAttributes has;
  if (get_attributes(has, thread) != 0 || has.policy != kDeadline || (has.flags & kOfCpufreq) != 0) return std::nullopt;
  Reservation reservation;
  reservation.policy = Policy::deadline;
  reservation.runtime_ns = static_cast<int64_t>(has.runtime);
  reservation.deadline_ns = static_cast<int64_t>(has.deadline);
  reservation.period_ns = static_cast<int64_t>(has.period);
  return reservation;
}

bool runnable(int thread) {
  const std::optional<ThreadState> told = thread_state(thread);
  return told && told->runnable();
}

bool restore_thread(const Reservation& had) {
  if (had.policy == Policy::deadline) return set_attributes(attributes_of(had)) == 0;
  if (had.policy != Policy::fixed) return true;
  const sched_param param{had.priority};
  return sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) == 0;
}

void apply_default() {
  const sched_param param{0};
  sched_setscheduler(0, SCHED_OTHER, &param);
}

}  // namespace takt
