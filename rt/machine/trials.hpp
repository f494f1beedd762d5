// SPDX-License-Identifier: Apache-2.0
// Privileges are tried by using them, and what the kernel gave is read back. Each trial happens in a forked process, so
// that nothing of it stays; one that does not answer is `answered == false`. The calling process must have one thread.
#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "rt/sched/plan.hpp"
#include "rt/shm/iceoryx_preflight.hpp"

namespace takt::machine {

struct PolicyTrial {
  bool answered = false;
  int error = 0;                          ///< errno of the refusal; 0: accepted
  bool verified = false;                  ///< sched_getattr says the same
  int priority = 0;                       ///< fixed
  int64_t runtime_ns = 0, period_ns = 0;  ///< deadline
};

struct BandwidthTrial {
  bool answered = false;
  bool granted = false;             ///< SCHED_DEADLINE is
  double limit = 0, free = 0;       ///< cores
  double lost = 0;                  ///< held by no living thread
  std::array<char, 512> holders{};  ///< who holds the rest, "" if nobody does
  std::array<char, 128> recount{};  ///< command that makes the kernel count anew
};

struct LockTrial {
  bool answered = false;
  int error = 0;          ///< of mlockall(MCL_CURRENT | MCL_FUTURE)
  int64_t locked_kb = 0;  ///< VmLck after it
  int64_t size_kb = 0;    ///< VmSize after it
  int more_error = 0;     ///< of taking 64 MB more while locked: a limit shows only then
  int64_t limit_kb = 0;   ///< RLIMIT_MEMLOCK; -1: none
};

struct LatencyTrial {
  bool answered = false;
  int error = 0;              ///< of opening and writing /dev/cpu_dma_latency
  int64_t effective_us = -1;  ///< read back while held; -1: cannot be read
};

struct SlackTrial {
  bool answered = false;
  int error = 0;
  int64_t slack_ns = 0;  ///< read back
};

struct SharedMemoryTrial {
  bool answered = false;
  int error = 0;  ///< of making, growing and mapping a file there
  int64_t size_mb = 0, free_mb = 0;
};

struct TickTrial {
  bool answered = false;
  int64_t tick_ns = 0;  ///< resolution of CLOCK_MONOTONIC_COARSE, which is advanced by the tick
  int64_t step_ns = 0;  ///< least distance of two of its steps seen in 40 ms; 0: none
};

struct DaemonTrial {
  bool answered = false;
  std::array<char, 512> refused{};  ///< why no iceoryx daemon can start; empty: it can
  bool private_room = false;        ///< but a run may take a /tmp and /dev/shm of its own
};

/// Of the running program and of the thread that asks.
struct RightsTrial {
  bool answered = false;
  uint64_t held = 0;     ///< capabilities, bit by CAP_ number
  bool by_file = false;  ///< the program's file gives them (setcap); else whoever started it does
  uint32_t mode = 0;     ///< of that file
};

/// The watchdog of the machine that comes first.
struct WatchdogTrial {
  bool answered = false;
  bool there = false, active = false;
  bool sees_all = false;  ///< whoever holds it would have been seen
  int64_t timeout_s = 0;
  std::array<char, 64> name{};     ///< "watchdog0 (iTCO_wdt)"
  std::array<char, 128> holder{};  ///< "systemd (pid 1)"; "" if none was seen
};

struct Trials {
  PolicyTrial deadline, fixed;
  BandwidthTrial bandwidth;
  LockTrial lock;
  LatencyTrial latency;
  SlackTrial slack;
  SharedMemoryTrial shared_memory;
  TickTrial tick;
  DaemonTrial daemon;
  RightsTrial rights;
  WatchdogTrial watchdog;
};

/// All of them; about 0.1 s, never longer than a few seconds.
Trials try_machine();

}  // namespace takt::machine
