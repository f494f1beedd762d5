// SPDX-License-Identifier: Apache-2.0
#include "rt/capability.hpp"

#include <linux/capability.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <exception>
#include <filesystem>
#include <fstream>
#include <thread>

namespace takt {
namespace {

// The C library has no wrappers, and libcap would be a dependency for two calls.
using Sets = std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3>;
constexpr uint64_t kNice = uint64_t{1} << CAP_SYS_NICE, kLock = uint64_t{1} << CAP_IPC_LOCK,
                   kPerfmon = uint64_t{1} << CAP_PERFMON;

bool get(Sets& sets) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  return syscall(SYS_capget, &header, sets.data()) == 0;
}

void set(const Sets& sets) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  syscall(SYS_capset, &header, sets.data());
}

bool has_any() {
  Sets sets{};
  return get(sets) && (sets[0].permitted | sets[1].permitted) != 0;
}

}  // namespace

bool has_capability(unsigned capability) {
  Sets sets{};
  return get(sets) && (sets[0].effective >> capability & 1U) != 0;
}

bool locked_memory_is_limited() {
  rlimit limit{};
  return getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY;
}

void keep_rights(Rights rights, bool memory_limited) {
  if (geteuid() == 0) return;
  prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0UL, 0UL, 0UL);
  Sets sets{};
  if (!get(sets)) return;
  uint64_t kept = memory_limited ? kLock : 0;
  if (rights >= Rights::real_time) kept |= kNice;
  if (rights >= Rights::observe) kept |= kPerfmon;
  for (__user_cap_data_struct& half : sets) {
    half.effective = half.permitted &= static_cast<uint32_t>(kept);
    half.inheritable = 0;
    kept >>= 32;
  }
  set(sets);
}

void without_rights(const std::function<void()>& work) {
  if (geteuid() == 0 || !has_any()) return work();
  std::exception_ptr problem;
  const int policy = sched_getscheduler(0);
  sched_param priority{};
  sched_getparam(0, &priority);
  std::thread([&] {
    if (priority.sched_priority > 0) sched_setscheduler(0, policy, &priority);
    keep_rights(Rights::none);
    try {
      work();
    } catch (...) {
      problem = std::current_exception();
    }
  }).join();
  if (problem) std::rethrow_exception(problem);
}

std::vector<ThreadRights> thread_rights(pid_t process) {
  std::vector<ThreadRights> all;
  std::error_code error;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task", error)) {
    std::ifstream status(thread.path() / "status");
    ThreadRights rights;
    bool told = false;
    for (std::string key; status >> key;) {
      if (key == "Name:") std::getline(status >> std::ws, rights.name);
      else if (key == "CapPrm:") told = static_cast<bool>(status >> std::hex >> rights.capabilities);
    }
    if (told) all.push_back(std::move(rights));
  }
  return all;
}

std::string capabilities_text(uint64_t capabilities) {
  if (capabilities == 0) return "none";
  std::string text;
  for (unsigned c = 0; c < 64; ++c) {
    if ((capabilities >> c & 1U) == 0) continue;
    text += text.empty() ? "" : " ";
    text += c == CAP_SYS_NICE   ? "CAP_SYS_NICE"
            : c == CAP_IPC_LOCK ? "CAP_IPC_LOCK"
            : c == CAP_PERFMON  ? "CAP_PERFMON"
                                : std::to_string(c);
  }
  return text;
}

}  // namespace takt
