// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/mman.h>

#include <cstddef>

namespace takt {

/// mmap(), but pages become resident as they are used, also where all memory is locked (prepare_process_memory()),
/// which else reads in the whole of a file. For threads that may wait for a page:
///
///   void* memory = map_as_used(bytes, PROT_READ, MAP_PRIVATE, descriptor);
///   if (memory == MAP_FAILED) return errno;
///
/// Any thread.
inline void* map_as_used(size_t bytes, int protection, int flags, int descriptor = -1) {
  // What may be accessed is made resident at once (MCL_FUTURE): so nothing may until the lock is off.
  void* memory = mmap(nullptr, bytes, PROT_NONE, flags, descriptor, 0);
  if (memory == MAP_FAILED) return memory;
  munlock(memory, bytes);
  if (mprotect(memory, bytes, protection) == 0) return memory;
  munmap(memory, bytes);
  return MAP_FAILED;
}

}  // namespace takt
