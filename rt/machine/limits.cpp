// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/limits.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <system_error>

#include "rt/machine/parse.hpp"

namespace takt::machine {
namespace {

constexpr int64_t kMB = 1'000'000;
constexpr int64_t kNoLimit = int64_t{1} << 62;  ///< cgroup v1 writes the largest number that it has

/// A control group of this process, and what one of its files says.
struct GroupLimit {
  std::string group;
  int64_t limit = 0, used = 0;
  int64_t free() const { return limit - used; }
};

/// Where the groups of a controller lie (v1, else v2) and this process's path there.
struct Hierarchy {
  std::string mount, path;
  bool unified = false;
};
std::optional<Hierarchy> hierarchy(const Facts& facts, std::string_view controller) {
  const std::string groups = facts.text("/proc/self/cgroup").value_or(""),
                    mounts = facts.text("/proc/self/mounts").value_or("");
  for (const bool unified : {false, true}) {
    const auto path = cgroup_path(groups, unified ? "" : controller),
               mount = cgroup_mount(mounts, unified ? "" : controller);
    if (path && mount) return Hierarchy{*mount, *path, unified};
  }
  return std::nullopt;
}

/// Files of a controller, v1 or v2.
struct Counter {
  std::string limit, used;
  std::string statistics = {};  ///< with pages of files, which the kernel drops first: as good as free
  std::string prefix = {};      ///< of its keys
};

int64_t pages_of_files(const std::string& statistics, const std::string& prefix) {
  int64_t bytes = 0;
  for_each_line(statistics, [&](std::string_view line) {
    for (const std::string& key : {prefix + "inactive_file ", prefix + "active_file "})
      if (line.substr(0, key.size()) == key) bytes += parse_number(line.substr(key.size())).value_or(0);
  });
  return bytes;
}

/// Of the groups from this process's up to the root, the one with the least room.
std::optional<GroupLimit> tightest(const Facts& facts, const Hierarchy& where, const Counter& counter) {
  std::optional<GroupLimit> found;
  for (std::string path = where.path;; path.resize(path.rfind('/'))) {
    const std::string folder = where.mount + (path == "/" ? "" : path) + "/";
    const auto limit = parse_number(facts.text(folder + counter.limit).value_or(""));
    const auto used = parse_number(facts.text(folder + counter.used).value_or(""));
    if (limit && used && *limit < kNoLimit) {
      const std::string statistics =
          counter.statistics.empty() ? "" : facts.text(folder + counter.statistics).value_or("");
      const GroupLimit here{path.empty() ? "/" : path, *limit, *used - pages_of_files(statistics, counter.prefix)};
      if (!found || here.free() < found->free()) found = here;
    }
    if (path.find('/') == std::string::npos || path == "/") return found;
  }
}

std::optional<GroupLimit> tasks_group(const Facts& facts) {
  const auto where = hierarchy(facts, "pids");
  return where ? tightest(facts, *where, {"pids.max", "pids.current"}) : std::nullopt;
}

std::optional<GroupLimit> memory_group(const Facts& facts) {
  const auto where = hierarchy(facts, "memory");
  if (!where) return std::nullopt;
  if (where->unified) return tightest(facts, *where, {"memory.max", "memory.current", "memory.stat"});
  return tightest(facts, *where, {"memory.limit_in_bytes", "memory.usage_in_bytes", "memory.stat", "total_"});
}

std::string number(int64_t value) { return std::to_string(value); }

std::string tasks_limit(const Facts& facts) {
  const auto group = tasks_group(facts);
  const auto of_user = facts.limit(RLIMIT_NPROC);
  if (group && (group->free() <= 1 || !of_user))
    return "pids.max " + number(group->limit) + " of control group " + group->group +
           ": TasksMax= of its unit, or --pids-limit of its container";
  if (of_user)
    return "RLIMIT_NPROC " + number(*of_user) +
           ", processes and threads of this user: ulimit -u, or nproc in /etc/security/limits.conf";
  return "";
}

std::string memory_limit(const Facts& facts) {
  constexpr int64_t kNear = 64 * kMB;
  const auto group = memory_group(facts);
  const auto addresses = facts.limit(RLIMIT_AS), data = facts.limit(RLIMIT_DATA);
  if (group && (group->free() < kNear || !(addresses || data)))
    return "memory limit " + number(group->limit / kMB) + " MB of control group " + group->group +
           ": MemoryMax= of its unit, or --memory of its container";
  if (addresses) return "RLIMIT_AS " + number(*addresses / kMB) + " MB: ulimit -v unlimited";
  if (data) return "RLIMIT_DATA " + number(*data / kMB) + " MB: ulimit -d unlimited";
  if (parse_number(facts.text("/proc/sys/vm/overcommit_memory").value_or("")) == 2)
    return "vm.overcommit_memory is 2: sysctl vm.overcommit_memory=0";
  return "";
}

std::string files_limit(const Facts& facts) {
  const auto limit = facts.limit(RLIMIT_NOFILE);
  return limit ? "RLIMIT_NOFILE " + number(*limit) + ": ulimit -n 1024, or LimitNOFILE= of its unit" : "";
}

std::optional<Scarce> scarce_of(int error_number) {
  switch (error_number) {
    case EAGAIN: return Scarce::tasks;
    case ENOMEM: return Scarce::memory;
    case EMFILE: return Scarce::files;
    default: return std::nullopt;
  }
}

std::string with_limit(const std::string& text, std::optional<Scarce> what, const Facts& facts) {
  const std::string limit = what ? limit_on(*what, facts) : "";
  return limit.empty() ? text : text + " (" + limit + ")";
}

}  // namespace

std::string limit_on(Scarce what, const Facts& facts) {
  switch (what) {
    case Scarce::tasks: return tasks_limit(facts);
    case Scarce::memory: return memory_limit(facts);
    case Scarce::files: break;
  }
  return files_limit(facts);
}

std::optional<int64_t> memory_room(const Facts& facts) {
  const auto group = memory_group(facts);
  return group ? std::optional(group->free()) : std::nullopt;
}

int64_t memory_kills(const Facts& facts) {
  const auto where = hierarchy(facts, "memory");
  if (!where) return 0;
  const std::string file = where->mount + (where->path == "/" ? "" : where->path) +
                           (where->unified ? "/memory.events" : "/memory.oom_control");
  int64_t kills = 0;
  for_each_line(facts.text(file).value_or(""), [&](std::string_view line) {
    constexpr std::string_view kKills = "oom_kill ";
    if (line.substr(0, kKills.size()) == kKills) kills = parse_number(line.substr(kKills.size())).value_or(0);
  });
  return kills;
}

std::optional<Scarce> scarce(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return Scarce::memory;
  const auto* of_system = dynamic_cast<const std::system_error*>(&error);
  if (of_system == nullptr || (of_system->code().category() != std::generic_category() &&
                               of_system->code().category() != std::system_category()))
    return std::nullopt;
  return scarce_of(of_system->code().value());
}

std::string explain(const std::exception& error, const Facts& facts) {
  const auto what = scarce(error);
  const std::string text = what == Scarce::memory  ? "no more memory"
                           : what == Scarce::tasks ? "no more threads or processes"
                                                   : error.what();
  return with_limit(text, what, facts);
}

std::string explain(const std::string& what, int error_number, const Facts& facts) {
  return with_limit(what + ": " + std::strerror(error_number), scarce_of(error_number), facts);
}

namespace {

/// Says with what memory there is left. Nothing may be thrown here.
[[noreturn]] void say_and_end() {
  std::array<char, 16> thread{};
  pthread_getname_np(pthread_self(), thread.data(), thread.size());
  std::optional<Scarce> what;
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    what = scarce(error);
    std::string text = error.what();
    try {
      text = explain(error);
    } catch (const std::exception&) {  // no memory for that either
    }
    std::fprintf(stderr, "takt: error: thread %s: %s\n", thread.data(), text.c_str());
  } catch (...) {
    std::fprintf(stderr, "takt: error: thread %s: something was thrown that is no std::exception\n", thread.data());
  }
  if (what) _exit(3);  // the machine's, not a bug: no core
  std::abort();
}

}  // namespace

void go_first_without_memory(int score) { std::ofstream("/proc/self/oom_score_adj") << score; }

void explain_what_nobody_catches() { std::set_terminate(say_and_end); }

}  // namespace takt::machine
