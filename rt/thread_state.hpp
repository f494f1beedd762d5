// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <optional>

namespace takt {

/// What the kernel tells of a thread of any process (proc(5), /proc/PID/stat).
struct ThreadState {
  char state = 0;      ///< 'R' running or ready to, 'S' and 'D' waiting, 'T' stopped, 'Z' and 'X' ended
  unsigned flags = 0;  ///< PF_... of the kernel's <linux/sched.h>
  /// Of one that is ending: as waitpid(2) will say, the signal in the lowest seven bits; 0 also where the kernel does
  /// not tell this process.
  int status = 0;

  /// It runs, or would but for its turn or its reservation.
  bool runnable() const { return state == 'R'; }
  /// It has ended; of a process's first thread: though others, or its parent's question, may still be missing.
  bool ended() const { return state == 'Z' || state == 'X'; }
  /// It has ended, or clears up to do so: it runs nothing of its program any more.
  bool ending() const { return ended() || (flags & kExiting) != 0; }
  bool ending_by_signal() const { return ending() && (flags & kSignaled) != 0; }

 private:
  static constexpr unsigned kExiting = 0x4, kSignaled = 0x400;  // PF_EXITING, PF_SIGNALED
};

/// Of the thread with that number; a process's number is that of its first thread. Nothing if there is none. Any
/// thread; allocates nothing, some microseconds.
std::optional<ThreadState> thread_state(pid_t thread);

}  // namespace takt
