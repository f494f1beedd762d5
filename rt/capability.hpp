// SPDX-License-Identifier: Apache-2.0
// The rights of threads. A process that is not root gives up what it no longer needs, thread by thread:
//
//   without_rights([&] { open_devices(); });  // their threads have none
//   std::thread worker([] { keep_rights(Rights::real_time); ... });
//
// Root keeps all of them: it would have them again after the next exec, and its drivers may need any.
#pragma once
#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace takt {

/// True if the calling thread has that capability in effect: a CAP_ number of <linux/capability.h> below 32. Root has
/// all of them unless a container took them away; `setcap` and systemd give single ones. Any thread.
bool has_capability(unsigned capability);

enum class Rights {
  none,
  real_time,  ///< CAP_SYS_NICE: real-time policies, for itself and for others
  observe,    ///< and CAP_PERFMON, for a trace: all that a run ever needs
};

/// RLIMIT_MEMLOCK of this process is not infinity.
bool locked_memory_is_limited();

/// From here on the calling thread has these rights at most, and so have the threads and processes that it makes later,
/// programs that they execute included. CAP_IPC_LOCK stays where memory that may be locked is limited:
/// once future memory is locked, each further allocation needs it; without a limit nothing does.
/// Nothing happens to root, nor where the kernel refuses; thread_rights() tells.
void keep_rights(Rights rights, bool memory_limited = locked_memory_is_limited());

/// Runs `work` without any rights; on a thread of its own, of the same priority, if the calling one has some. Throws what
/// `work` throws.
void without_rights(const std::function<void()>& work);

/// What a thread could use of the capabilities (its permitted ones), bit by CAP_ number.
struct ThreadRights {
  std::string name;
  uint64_t capabilities = 0;
};
/// Of all threads of a process; empty if it has ended, or hides from the calling thread (under hidepid, one with fewer
/// capabilities).
std::vector<ThreadRights> thread_rights(pid_t process);

/// "CAP_IPC_LOCK CAP_SYS_NICE"; others by number; "none".
std::string capabilities_text(uint64_t capabilities);

}  // namespace takt
