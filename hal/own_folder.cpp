// SPDX-License-Identifier: Apache-2.0
#include "hal/own_folder.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>

namespace takt::hal {
namespace {

namespace fs = std::filesystem;

/// Nothing if it cannot be had, or somebody has it and `wait` is not set.
Descriptor lock(const fs::path& folder, bool wait) {
  Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (opened && flock(opened.get(), wait ? LOCK_EX : LOCK_EX | LOCK_NB) != 0) opened.close();
  return opened;
}

void remove_abandoned(const fs::path& parent, const std::string& prefix) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(parent, ignored)) {
    if (!entry.path().filename().string().starts_with(prefix)) continue;
    if (const Descriptor locked = lock(entry.path(), false)) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace

OwnFolder::OwnFolder(const fs::path& parent, const std::string& prefix) {
  remove_abandoned(parent, prefix);
  std::error_code error;
  // Before it is locked another process may take it for abandoned.
  for (int tries = 0; tries < 3; ++tries) {
    std::string name = (parent / (prefix + "XXXXXX")).string();
    if (mkdtemp(name.data()) == nullptr) return;
    lock_ = lock(name, true);
    if (!lock_ || !fs::exists(name, error)) continue;
    path_ = name;
    return;
  }
}

OwnFolder::~OwnFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

}  // namespace takt::hal
