// SPDX-License-Identifier: Apache-2.0
// Counts copies of more than 64 KiB in this program by taking the place of memcpy and memmove: a zero-copy transport
// makes none, whatever the size of the message.
#pragma once
#include <cstdint>

namespace takt::bench {

/// Since the start of the process, all threads.
uint64_t large_copies();

}  // namespace takt::bench
