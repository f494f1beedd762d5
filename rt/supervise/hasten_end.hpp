// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <cstddef>
#include <optional>

namespace takt {

/// Whether a process is ending: its first thread has ended, or is about to, whatever the others do.
bool is_ending(pid_t process);
/// The signal that ends a process, once none of its threads will run any more of its program: what it shares with
/// others is as it left it, long before the kernel has cleared it up and waitpid(2) answers. SIGKILL where the kernel
/// does not tell this process; nothing for one that lives, or ends by itself.
std::optional<int> signal_of_dead(pid_t process);

/// Lets a process that is ending go at once. Its last thread clears up the memory of all of them, which takes 10 to 50
/// ms of CPU time; if that one has a small reservation under SCHED_DEADLINE, it waits for a period after each bit of
/// it, for seconds in all (0.5 ms of each 500 measured: 6.3 s). So those of its threads that wait for their reservation
/// are put behind all workers and before ordinary threads instead; so are its ordinary ones, if a signal ends it:
/// beside six hogs on two CPUs their clearing up took 0.2 to 0.5 s. To be said again until the process has ended, since
/// another thread may be the last. Returns how many were let go; whoever may not do that lets none go.
size_t hasten_end(pid_t process);

}  // namespace takt
