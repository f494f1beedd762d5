// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/iceoryx_preflight.hpp"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <optional>
#include <utility>
#include <vector>

#include "rt/file/lock_holder.hpp"
#include "rt/shm/iceoryx_transport.hpp"
#include "rt/shm/transport_error.hpp"
#include "rt/thread_state.hpp"

namespace takt {
namespace {

// Names compiled into iceoryx 2.0.
constexpr const char* kLock = "iox-unique-roudi.lock";
constexpr const char* kSocket = "roudi";
constexpr const char* kManagement = "iceoryx_mgmt";

std::string user_name(uid_t user) {
  std::array<char, 1024> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found) == 0 && found != nullptr) return found->pw_name;
  return "user " + std::to_string(user);
}

std::string process_name(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/comm");
  std::string name;
  std::getline(file, name);
  return name.empty() ? "?" : name;
}

std::string megabytes(uint64_t bytes) { return std::to_string((bytes + 999'999) / 1'000'000) + " MB"; }

[[noreturn]] void daemon_running(const std::filesystem::path& lock, const std::filesystem::path& locks) {
  const auto holder = lock_holder(lock, locks);
  const std::string who =
      holder ? "process " + std::to_string(*holder) + " (" + process_name(*holder) + ")" : "another process";
  throw TransportError("another iceoryx daemon is running: " + who + " holds " + lock.string() +
                       "; there can be one on a machine. Stop it" +
                       (holder ? " (kill " + std::to_string(*holder) + ")" : "") +
                       " or run without --transport iceoryx");
}

[[noreturn]] void foreign(const std::filesystem::path& file, uid_t owner, uid_t user) {
  throw TransportError(file.string() + " belongs to " + user_name(owner) + ", this process runs as " + user_name(user) +
                       ": left behind by an iceoryx daemon of " + user_name(owner) + ". Remove it: sudo rm " +
                       file.string());
}

/// A file we could not replace: another user's in a directory with the sticky bit.
void check_owner(const std::filesystem::path& file, uid_t user) {
  struct stat status {};
  if (user == 0 || lstat(file.c_str(), &status) != 0) return;
  if (status.st_uid != user) foreign(file, status.st_uid, user);
}

/// Takes the lock. From a process that is just ending it is awaited, two seconds at most: its threads go one after the
/// other, and the lock goes with the last of them. It may do so just before the holder is asked for; nobody is known to
/// hold it then, as of a lock of a process that is not to be seen from here: that one is not awaited for long.
bool take_lock(int file, const std::filesystem::path& lock, const std::filesystem::path& locks) {
  constexpr timespec kStep{0, 5'000'000};
  constexpr int kMostTries = 400, kMostUnknown = 3;
  for (int tries = 0, unknown = 0; flock(file, LOCK_EX | LOCK_NB) != 0; ++tries) {
    const std::optional<pid_t> holder = lock_holder(lock, locks);
    const std::optional<ThreadState> told = holder ? thread_state(*holder) : std::nullopt;
    unknown += !holder;
    if (unknown == kMostUnknown || (told && !told->ending()) || tries == kMostTries) return false;
    nanosleep(&kStep, nullptr);
  }
  return true;
}

void check_lock(const std::filesystem::path& lock, const IceoryxPlaces& places) {
  const int file = open(lock.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) {
    if (errno == ENOENT) return;
    const int reason = errno;
    struct stat status {};
    if (lstat(lock.c_str(), &status) == 0 && status.st_uid != places.user) foreign(lock, status.st_uid, places.user);
    throw TransportError("cannot open " + lock.string() + ": " + std::strerror(reason) + ". Remove it: sudo rm " +
                         lock.string());
  }
  const bool free = take_lock(file, lock, places.locks);
  struct stat status {};
  const bool known = fstat(file, &status) == 0;
  close(file);
  if (!free) daemon_running(lock, places.locks);
  // Not even root can reuse another user's file here: fs.protected_regular refuses O_CREAT on it in a sticky directory.
  if (known && status.st_uid != places.user) foreign(lock, status.st_uid, places.user);
}

/// One that has ended, but whose parent has not asked for its end yet, is dead.
bool is_dead(pid_t pid) {
  if (kill(pid, 0) != 0) return errno == ESRCH;
  const std::optional<ThreadState> told = thread_state(pid);
  return told && told->ended();
}

/// A run that was killed whole had nobody left to remove what its clients leave.
void remove_leftovers_of_the_dead(const IceoryxPlaces& places) {
  std::vector<pid_t> dead;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(places.run, ignored)) {
    int pid = 0, number = 0;
    if (std::sscanf(entry.path().filename().c_str(), "takt-%d-%d", &pid, &number) != 2 || pid <= 0) continue;
    if (is_dead(pid)) dead.push_back(pid);
  }
  for (const pid_t pid : dead) remove_iceoryx_leftovers(places, pid);
}

}  // namespace

IceoryxPlaces IceoryxPlaces::of_this_machine() {
  IceoryxPlaces places;
  places.user = geteuid();
  std::array<char, 4096> buffer{};
  group entry{};
  group* found = nullptr;
  if (getgrgid_r(getegid(), &entry, buffer.data(), buffer.size(), &found) == 0 && found != nullptr)
    places.segment = found->gr_name;
  return places;
}

void iceoryx_preflight(const IceoryxPlaces& places, uint64_t needed_bytes) {
  if (places.segment.empty())
    throw TransportError("the group " + std::to_string(getegid()) +
                         " of this process has no name, iceoryx needs one to name its "
                         "shared memory. Add it: sudo groupadd --gid " +
                         std::to_string(getegid()) + " takt");
  check_lock(places.run / kLock, places);
  remove_leftovers_of_the_dead(places);
  check_owner(places.run / kSocket, places.user);
  uint64_t reclaimed = 0;
  for (const auto& file : {places.shm / kManagement, places.shm / places.segment}) {
    check_owner(file, places.user);
    struct stat status {};
    if (stat(file.c_str(), &status) == 0) reclaimed += static_cast<uint64_t>(status.st_blocks) * 512;
  }
  for (const auto& folder : {places.run, places.shm})
    if (access(folder.c_str(), W_OK) != 0 && errno != ENOENT)
      throw TransportError(folder.string() + " cannot be written: " + std::strerror(errno) +
                           ". iceoryx has its files there: mount a tmpfs, or run without --transport iceoryx");
  struct statvfs room {};
  if (statvfs(places.shm.c_str(), &room) != 0)
    throw TransportError(places.shm.string() + ": " + std::strerror(errno) + ". Mount it: sudo mount -t tmpfs tmpfs " +
                         places.shm.string());
  const uint64_t available = uint64_t{room.f_bavail} * room.f_frsize + reclaimed;
  if (available < needed_bytes)
    throw TransportError(
        places.shm.string() + " has " + megabytes(available) + " free, the message pools of this graph need " +
        megabytes(needed_bytes) + ". Enlarge it: sudo mount -o remount,size=" +
        std::to_string((needed_bytes - available + uint64_t{room.f_blocks} * room.f_frsize + 1'048'575) / 1'048'576) +
        "M " + places.shm.string() + ", or lower image sizes or edge depths");
}

void remove_iceoryx_leftovers(const IceoryxPlaces& places, pid_t dead) {
  const std::string name = iceoryx_runtime_prefix(dead);
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(places.run, ignored))
    if (entry.path().filename().string().rfind(name, 0) == 0) std::filesystem::remove(entry.path(), ignored);
}

DaemonClaim::DaemonClaim(const IceoryxPlaces& places) : folder_(open(places.shm.c_str(), O_RDONLY | O_CLOEXEC)) {
  // The folder itself is locked: it is there, everybody may read it, and each mount namespace has its own.
  if (folder_ < 0 || take_lock(folder_, places.shm, places.locks)) return;
  close(std::exchange(folder_, -1));
  throw TransportError(
      "another iceoryx daemon is running: it is being started at this moment; there can be one on a machine");
}

void DaemonClaim::release() {
  if (folder_ < 0) return;
  flock(folder_, LOCK_UN);
  close(std::exchange(folder_, -1));
}

}  // namespace takt
