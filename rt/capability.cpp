// SPDX-License-Identifier: Apache-2.0
#include "rt/capability.hpp"

#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>

namespace takt {

bool has_capability(unsigned capability) {
  // The C library has no wrapper, and libcap would be a dependency for one call.
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
  return syscall(SYS_capget, &header, sets.data()) == 0 && (sets[0].effective >> capability & 1U) != 0;
}

}  // namespace takt
