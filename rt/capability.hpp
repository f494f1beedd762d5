// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace takt {

/// True if the calling thread has that capability in effect: a CAP_ number of <linux/capability.h> below 32. Root has
/// all of them unless a container took them away; `setcap` and systemd give single ones. Any thread.
bool has_capability(unsigned capability);

}  // namespace takt
