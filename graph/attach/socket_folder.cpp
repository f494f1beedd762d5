// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/socket_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>

#include "rt/machine/limits.hpp"

namespace takt::attach {
namespace {

/// A replay is never taken for the run that somebody wants to stop.
constexpr std::string_view kOfReplay = "replay-";

std::string socket_name(int pid, SocketFolder::Of whom) {
  return fmt::format("{}{}.sock", whom == SocketFolder::Of::replay ? kOfReplay : "", pid);
}

constexpr mode_t kAnyOther = S_IRWXG | S_IRWXO, kOthersWrite = S_IWGRP | S_IWOTH;

std::string name_of(uid_t user) {
  std::array<char, 1024> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found) == 0 && found != nullptr)
    return fmt::format("{} (uid {})", found->pw_name, user);
  return fmt::format("uid {}", user);
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// In the order in which they are tried.
std::vector<std::filesystem::path> places(const Surroundings& where) {
  const std::string mine = "takt." + std::to_string(where.user);
  std::vector<std::filesystem::path> all;
  if (!where.xdg_runtime.empty() && access(where.xdg_runtime.c_str(), W_OK) == 0)
    all.push_back(std::filesystem::path(where.xdg_runtime) / "takt");
  struct stat facts {};
  // Root's runs stay out of it: the service manager removes it with all that is in it when the service ends.
  if (where.user != 0 && lstat((where.run / "takt").c_str(), &facts) == 0 && facts.st_uid == where.user)
    all.push_back(where.run / "takt");
  if (where.user == 0) all.push_back(where.run / mine);
  all.push_back(where.tmp / mine);
  if (!where.home.empty()) all.push_back(std::filesystem::path(where.home) / ".cache" / "takt" / "run");
  return all;
}

/// Its parents, too, as they may be missing below a home. What is there already is left as it is.
void make(const std::filesystem::path& folder, const Surroundings& where) {
  if (!where.home.empty() && folder.string().starts_with(where.home + "/.cache/")) {
    mkdir((where.home + "/.cache").c_str(), 0700);
    mkdir((where.home + "/.cache/takt").c_str(), 0700);
  }
  mkdir(folder.c_str(), 0700);
}

}  // namespace

Surroundings Surroundings::of_this_process() {
  Surroundings where;
  where.user = geteuid();
  where.xdg_runtime = variable("XDG_RUNTIME_DIR");
  where.home = variable("HOME");
  return where;
}

std::optional<SocketFolder> SocketFolder::open(const std::filesystem::path& path, const Surroundings& where, For whom,
                                               std::string& why) {
  const auto refused = [&](const std::string& reason) {
    why += fmt::format("{}{}: {}", why.empty() ? "" : "; ", path.string(), reason);
    return std::nullopt;
  };
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  const int error = errno;
  struct stat facts {};
  if (descriptor < 0) {
    if (error == EMFILE || error == ENFILE) return refused(machine::explain("cannot be opened", error));
    if (lstat(path.c_str(), &facts) != 0) return refused(std::strerror(error));
    const char* kind = S_ISLNK(facts.st_mode)   ? "a link"
                       : S_ISDIR(facts.st_mode) ? "a folder"
                                                : "no folder, but a file";
    return refused(fmt::format("is {} of user {} ({}); its owner or root removes it with: rm -r {}", kind,
                               name_of(facts.st_uid), std::strerror(error), path.string()));
  }
  SocketFolder folder(descriptor, path, 0);  // which closes it
  if (fstat(descriptor, &facts) != 0) return refused(std::strerror(errno));
  folder.mode_ = facts.st_mode;
  if (whom == For::own && facts.st_uid != where.user)
    return refused(fmt::format("belongs to user {}; its owner or root removes it with: rm -r {}", name_of(facts.st_uid),
                               path.string()));
  // The service manager made the service's, and says with its mode whether the group may come in.
  const bool of_service = path == where.run / "takt";
  const mode_t forbidden = whom == For::service ? kOthersWrite : of_service ? kOthersWrite | S_IRWXO : kAnyOther;
  if ((facts.st_mode & forbidden) != 0)
    return refused(fmt::format("is open to other users (mode {:04o}); close it with: chmod {} {}",
                               facts.st_mode & 07777, of_service ? "o=,g-w" : "go=", path.string()));
  return folder;
}

std::optional<SocketFolder> SocketFolder::own(const Surroundings& where, std::string& why) {
  for (const std::filesystem::path& place : places(where)) {
    make(place, where);
    if (auto folder = open(place, where, For::own, why)) return folder;
  }
  return std::nullopt;
}

std::optional<SocketFolder> SocketFolder::of_service(const Surroundings& where) {
  std::string unheard;
  return open(where.run / "takt", where, For::service, unheard);
}

SocketFolder::SocketFolder(SocketFolder&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)), mode_(other.mode_) {}

SocketFolder::~SocketFolder() {
  if (descriptor_ >= 0) close(descriptor_);
}

sockaddr_un SocketFolder::address(int pid, Of whom) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  fmt::format_to_n(address.sun_path, sizeof address.sun_path - 1, "/proc/self/fd/{}/{}", descriptor_,
                   socket_name(pid, whom));
  return address;
}

std::vector<int> SocketFolder::pids(Of whom) const {
  std::vector<int> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(fmt::format("/proc/self/fd/{}", descriptor_), error)) {
    const std::string name = entry.path().stem();
    const int pid = std::atoi(name.c_str() + (name.starts_with(kOfReplay) ? kOfReplay.size() : 0));
    if (pid > 0 && entry.path().filename() == socket_name(pid, whom)) found.push_back(pid);
  }
  std::sort(found.begin(), found.end());
  return found;
}

void SocketFolder::remove_socket(int pid, Of whom) const { unlinkat(descriptor_, socket_name(pid, whom).c_str(), 0); }

}  // namespace takt::attach
