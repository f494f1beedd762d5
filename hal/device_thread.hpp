// SPDX-License-Identifier: Apache-2.0
// The threads that devices keep beside the workers of the runtime.
#pragma once

namespace takt {

/// True if the calling thread has a real-time policy.
bool in_real_time();

/// Of the calling thread: the lowest real-time priority, behind every worker, or an ordinary one. Where the kernel
/// refuses, the thread stays as it is.
void take_priority(bool real_time);

}  // namespace takt
