// SPDX-License-Identifier: Apache-2.0
#include "rt/capability.hpp"

#include <doctest/doctest.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <thread>

namespace {

using namespace takt;

constexpr uint64_t kNice = uint64_t{1} << CAP_SYS_NICE, kLock = uint64_t{1} << CAP_IPC_LOCK;
constexpr int kNotRoot = 77, kGood = 0;

/// A process of an ordinary user with these two capabilities, ambient ones too, as a service manager makes it: what
/// `body` returns, or kNotRoot.
template <class Body>
int as_service(Body body) {
  const pid_t child = fork();
  if (child == 0) {
    if (geteuid() != 0 || prctl(PR_SET_KEEPCAPS, 1) != 0 || setresuid(65534, 65534, 65534) != 0) _exit(kNotRoot);
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    std::array<__user_cap_data_struct, 2> sets{};
    sets[0].permitted = sets[0].effective = sets[0].inheritable = static_cast<uint32_t>(kNice | kLock);
    if (syscall(SYS_capset, &header, sets.data()) != 0) _exit(kNotRoot);
    for (const unsigned c : {CAP_SYS_NICE, CAP_IPC_LOCK}) prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, c, 0UL, 0UL);
    _exit(body());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

uint64_t of_this_thread() {
  uint64_t held = 0;
  for (const ThreadRights& thread : thread_rights(getpid())) held |= thread.capabilities;
  return held;
}

bool ambient() { return prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_IS_SET, CAP_SYS_NICE, 0UL, 0UL) == 1; }

void expect(int code) {
  if (code == kNotRoot) MESSAGE("NOT RUN: only root can become a service's user");
  else CHECK(code == kGood);
}

}  // namespace

TEST_CASE("a thread gives up what it does not need, and what it starts executes without it") {
  expect(as_service([] {
    if (of_this_thread() != (kNice | kLock) || !ambient()) return 1;
    keep_rights(Rights::real_time, /*memory_limited=*/false);
    if (of_this_thread() != kNice || !has_capability(CAP_SYS_NICE) || ambient()) return 2;
    keep_rights(Rights::none, false);
    if (of_this_thread() != 0 || has_capability(CAP_SYS_NICE)) return 4;
    keep_rights(Rights::observe);  // what is given up does not come back
    return of_this_thread() == 0 ? kGood : 5;
  }));
}

TEST_CASE("where memory that may be locked is limited, the right to lock it stays: allocations need it") {
  expect(as_service([] {
    keep_rights(Rights::none, /*memory_limited=*/true);
    return of_this_thread() == kLock ? kGood : 1;
  }));
}

TEST_CASE("work without rights has none, what it throws arrives, and the caller keeps what it had") {
  expect(as_service([] {
    bool had_none = false, caught = false;
    try {
      without_rights([&] {
        had_none = !has_capability(CAP_SYS_NICE);
        throw std::runtime_error("as the test wants it");
      });
    } catch (const std::runtime_error&) {
      caught = true;
    }
    return had_none && caught && of_this_thread() == (kNice | kLock) ? kGood : 1;
  }));
}

TEST_CASE("rights are read thread by thread, with names") {
  expect(as_service([] {
    int code = 1;
    std::thread([&] {
      prctl(PR_SET_NAME, "of no right");
      keep_rights(Rights::none, false);
      const auto all = thread_rights(getpid());
      const auto mine =
          std::find_if(all.begin(), all.end(), [](const ThreadRights& t) { return t.name == "of no right"; });
      code = all.size() >= 2 && mine != all.end() && mine->capabilities == 0 ? kGood : 1;
    }).join();
    return code;
  }));
  CHECK(thread_rights(-1).empty());
  CHECK(capabilities_text(0) == "none");
  CHECK(capabilities_text(kNice | kLock | 1) == "0 CAP_IPC_LOCK CAP_SYS_NICE");
}

TEST_CASE("root keeps what it has") {
  if (geteuid() != 0) {
    MESSAGE("NOT RUN: not root");
    return;
  }
  std::thread([] {
    const bool had = has_capability(CAP_SYS_NICE);
    keep_rights(Rights::none);
    CHECK(has_capability(CAP_SYS_NICE) == had);
  }).join();
}
