// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/private_mounts.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace takt {
namespace {

namespace fs = std::filesystem;

std::string failed(const std::string& what) { return what + ": " + std::strerror(errno); }

/// What iceoryx leaves in /tmp: the lock and socket of the daemon, sockets and locks of runtimes.
bool belongs_to_iceoryx(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename();
  std::error_code error;
  return name.find("roudi") != std::string::npos || (name.rfind("takt-", 0) == 0 && !entry.is_directory(error));
}

void show(const fs::directory_entry& entry, const fs::path& view) {
  std::error_code error;
  const fs::path target = view / entry.path().filename();
  if (entry.is_symlink(error)) return fs::copy_symlink(entry.path(), target, error);
  if (entry.is_directory(error)) fs::create_directory(target, error);
  else close(open(target.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  // An entry that vanishes meanwhile, or that may not be bound, is simply not shown.
  if (mount(entry.path().c_str(), target.c_str(), nullptr, MS_BIND | MS_REC, nullptr) != 0) fs::remove(target, error);
}

}  // namespace

std::string enter_private_mounts() {
  if (unshare(CLONE_NEWNS) != 0) return failed("a private mount namespace");
  if (mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return failed("private mounts");
  if (mount("takt", "/dev/shm", "tmpfs", MS_NOSUID | MS_NODEV, "mode=1777") != 0) return failed("mounting /dev/shm");
  const fs::path view = "/dev/shm/tmp";
  std::error_code error;
  fs::create_directory(view, error);
  if (mount("takt", view.c_str(), "tmpfs", MS_NOSUID | MS_NODEV, "mode=1777") != 0) return failed("mounting /tmp");
  for (const auto& entry : fs::directory_iterator("/tmp", error))
    if (!belongs_to_iceoryx(entry)) show(entry, view);
  if (mount(view.c_str(), "/tmp", nullptr, MS_MOVE, nullptr) != 0) return failed("moving the view to /tmp");
  fs::remove(view, error);
  return "";
}

}  // namespace takt
