// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>

namespace takt {

/// Process that holds an flock on `file`, if the kernel tells. `locks`: /proc/locks.
std::optional<pid_t> lock_holder(const std::filesystem::path& file, const std::filesystem::path& locks);

}  // namespace takt
