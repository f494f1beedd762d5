// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/trials.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <system_error>

#include "rt/capability.hpp"
#include "rt/machine/child.hpp"
#include "rt/machine/facts.hpp"
#include "rt/machine/measure_support.hpp"
#include "rt/machine/parse.hpp"
#include "rt/sched/bandwidth.hpp"
#include "rt/sched/grant.hpp"
#include "rt/shm/transport_error.hpp"
#include "rt/supervise/private_mounts.hpp"

namespace takt::machine {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr size_t kMore = 64 << 20;
constexpr const char* kShm = "/dev/shm";
constexpr const char* kLatencyFile = "/dev/cpu_dma_latency";

PolicyTrial try_policy(Policy policy) {
  Reservation wanted;
  wanted.policy = policy;
  wanted.priority = 50;
  wanted.runtime_ns = kMs;
  wanted.deadline_ns = wanted.period_ns = 10 * kMs;
  wanted.reclaims = policy == Policy::deadline;  // as lanes of high criticality have it
  const Grant grant = apply(wanted);
  PolicyTrial trial;
  trial.answered = true;
  trial.error = grant.error;
  trial.verified = grant.policy == policy && grant.verified;
  trial.priority = grant.priority;
  trial.runtime_ns = static_cast<int64_t>(grant.runtime_ms * 1e6);
  trial.period_ns = policy == Policy::deadline ? wanted.period_ns : 0;
  return trial;
}

BandwidthTrial try_bandwidth() {
  BandwidthTrial trial;
  trial.answered = true;
  const std::optional<DeadlineBandwidth> found = deadline_bandwidth();
  if (!found) return trial;
  trial.granted = true;
  trial.limit = found->limit;
  trial.free = found->free;
  trial.lost = found->lost();
  std::strncpy(trial.holders.data(), to_text(found->holders).c_str(), trial.holders.size() - 1);
  std::strncpy(trial.recount.data(), recount_command().c_str(), trial.recount.size() - 1);
  return trial;
}

LockTrial try_lock() {
  LockTrial trial;
  trial.answered = true;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  trial.limit_kb = limit.rlim_cur == RLIM_INFINITY ? -1 : static_cast<int64_t>(limit.rlim_cur / 1024);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) trial.error = errno;
  const std::string status = SystemFacts().text("/proc/self/status").value_or("");
  trial.locked_kb = parse_number(line_value(status, "VmLck")).value_or(0);
  trial.size_kb = parse_number(line_value(status, "VmSize")).value_or(0);
  if (trial.error == 0) {
    void* more = mmap(nullptr, kMore, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    trial.more_error = more == MAP_FAILED ? errno : 0;
  }
  return trial;
}

LatencyTrial try_latency() {
  LatencyTrial trial;
  trial.answered = true;
  // As a run does it: opened for writing only.
  const int file = open(kLatencyFile, O_WRONLY | O_CLOEXEC);
  const int32_t wanted_us = 0;
  if (file < 0 || write(file, &wanted_us, sizeof wanted_us) != sizeof wanted_us) {
    trial.error = errno;
    return trial;
  }
  const int reader = open(kLatencyFile, O_RDONLY | O_CLOEXEC);
  int32_t effective_us = 0;
  if (reader >= 0 && read(reader, &effective_us, sizeof effective_us) == sizeof effective_us)
    trial.effective_us = effective_us;
  return trial;
}

SlackTrial try_slack() {
  SlackTrial trial;
  trial.answered = true;
  if (prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) != 0) trial.error = errno;
  trial.slack_ns = prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL);
  return trial;
}

int make_and_map(size_t bytes) {
  const int file = open(kShm, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file < 0) return errno;
  if (const int error = posix_fallocate(file, 0, static_cast<off_t>(bytes)); error != 0) return error;
  auto* memory = static_cast<volatile char*>(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
  if (memory == MAP_FAILED) return errno;
  memory[0] = 1;
  return 0;
}

SharedMemoryTrial try_shared_memory() {
  SharedMemoryTrial trial;
  trial.answered = true;
  struct statvfs room {};
  if (statvfs(kShm, &room) != 0) {
    trial.error = errno;
    return trial;
  }
  trial.size_mb = static_cast<int64_t>(uint64_t{room.f_blocks} * room.f_frsize / 1'000'000);
  trial.free_mb = static_cast<int64_t>(uint64_t{room.f_bavail} * room.f_frsize / 1'000'000);
  trial.error = make_and_map(1 << 20);
  return trial;
}

TickTrial try_tick() {
  TickTrial trial;
  timespec resolution{};
  trial.answered = clock_getres(CLOCK_MONOTONIC_COARSE, &resolution) == 0;
  trial.tick_ns = resolution.tv_nsec;
  const int64_t end = now_ns() + 40 * kMs;
  int64_t last = read_ns(CLOCK_MONOTONIC_COARSE);
  while (now_ns() < end) {
    const int64_t coarse = read_ns(CLOCK_MONOTONIC_COARSE);
    if (coarse != last && (trial.step_ns == 0 || coarse - last < trial.step_ns)) trial.step_ns = coarse - last;
    last = coarse;
  }
  return trial;
}

DaemonTrial try_daemon() {
  constexpr uint64_t kDaemonBytes = 70'000'000;  // what iceoryx takes for itself, without any pool
  DaemonTrial trial;
  trial.answered = true;
  try {
    const DaemonClaim claim(IceoryxPlaces::of_this_machine());
    iceoryx_preflight(IceoryxPlaces::of_this_machine(), kDaemonBytes);
  } catch (const TransportError& refused) {
    std::strncpy(trial.refused.data(), refused.what(), trial.refused.size() - 1);
    trial.private_room = enter_private_mounts().empty();
  }
  return trial;
}

RightsTrial try_rights() {
  RightsTrial trial;
  const std::string program = SystemFacts().program();
  struct stat facts {};
  if (stat(program.c_str(), &facts) != 0) return trial;
  trial.answered = true;
  trial.mode = facts.st_mode;
  trial.by_file = getxattr(program.c_str(), "security.capability", nullptr, 0) > 0;
  for (const ThreadRights& thread : thread_rights(getpid())) trial.held |= thread.capabilities;
  return trial;
}

/// The process that has a device file open; "" if none that may be looked at has. A file's descriptors are links.
std::string holder_of(const std::string& device, const SystemFacts& facts) {
  for (const std::string& process : facts.list("/proc")) {
    if (process.find_first_not_of("0123456789") != std::string::npos) continue;
    for (const std::string& descriptor : facts.list("/proc/" + process + "/fd")) {
      std::error_code error;
      const auto file = std::filesystem::read_symlink("/proc/" + process + "/fd/" + descriptor, error);
      if (!error && (file == "/dev/" + device || (device == "watchdog0" && file == "/dev/watchdog")))
        return trimmed(facts.text("/proc/" + process + "/comm").value_or("")) + " (pid " + process + ")";
    }
  }
  return "";
}

WatchdogTrial try_watchdog() {
  const SystemFacts facts;
  WatchdogTrial trial;
  trial.answered = true;
  const std::vector<std::string> all = facts.list("/sys/class/watchdog");
  trial.there = !all.empty();
  if (!trial.there) return trial;
  const std::string folder = "/sys/class/watchdog/" + all.front();
  const auto told = [&](const char* what) { return trimmed(facts.text(folder + "/" + what).value_or("")); };
  trial.active = told("state") == "active";
  trial.timeout_s = parse_number(told("timeout")).value_or(0);
  trial.sees_all = facts.is_root();
  std::strncpy(trial.name.data(), (all.front() + " (" + told("identity") + ")").c_str(), trial.name.size() - 1);
  std::strncpy(trial.holder.data(), holder_of(all.front(), facts).c_str(), trial.holder.size() - 1);
  return trial;
}

template <class Trial>
Trial tried(Trial (*body)()) {
  return in_child<Trial>(body).value_or(Trial{});
}

}  // namespace

Trials try_machine() {
  Trials trials;
  trials.deadline = tried<PolicyTrial>([] { return try_policy(Policy::deadline); });
  trials.fixed = tried<PolicyTrial>([] { return try_policy(Policy::fixed); });
  trials.bandwidth = tried(try_bandwidth);
  trials.lock = tried(try_lock);
  trials.latency = tried(try_latency);
  trials.slack = tried(try_slack);
  trials.shared_memory = tried(try_shared_memory);
  trials.tick = tried(try_tick);
  trials.daemon = tried(try_daemon);
  trials.rights = tried(try_rights);
  trials.watchdog = tried(try_watchdog);
  return trials;
}

}  // namespace takt::machine
