// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstring>

#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/parse.hpp"

namespace takt::machine {
namespace {

std::string mb_of_kb(int64_t kb) { return std::to_string((kb + 500) / 1000) + " MB"; }

}  // namespace

Finding check_mlockall(const Facts& facts, const LockTrial& trial) {
  Finding f{"memory", "mlockall", Need::every_run, Status::lacks, "", ""};
  f.meaning = "locked pages cannot be swapped out: no page fault in a job";
  if (!trial.answered) return not_answered(f), f;
  const std::string limit = trial.limit_kb < 0 ? "no limit" : "limit " + std::to_string(trial.limit_kb) + " KiB";
  // Mappings without rights count into the size but hold no page to lock.
  if (trial.error == 0 && trial.more_error == 0 && trial.locked_kb * 2 >= trial.size_kb) {
    f.status = Status::ok;
    f.found = mb_of_kb(trial.locked_kb) + " locked (VmLck), 64 MB more taken while locked; " + limit;
    return f;
  }
  if (trial.error != 0) f.found = std::string("refused: ") + std::strerror(trial.error) + "; " + limit;
  else if (trial.more_error != 0) f.found = "locked, but 64 MB more were refused; " + limit;
  else f.found = "accepted, but only " + mb_of_kb(trial.locked_kb) + " of " + mb_of_kb(trial.size_kb) + " are locked";
  f.fixes = grant_rights(facts);
  f.fixes.push_back(limits_line(facts, "memlock unlimited"));
  return f;
}

Finding check_dev_shm(const SharedMemoryTrial& trial) {
  constexpr int64_t kUsual = 500;  // the ACE graph over iceoryx
  Finding f{"memory", "dev_shm", Need::iceoryx, Status::lacks, "", ""};
  f.meaning = "`--transport iceoryx` keeps all messages there (ace: 480 MB)";
  if (!trial.answered) return not_answered(f), f;
  f.found = std::to_string(trial.free_mb) + " of " + std::to_string(trial.size_mb) + " MB free";
  if (trial.error != 0) {
    f.found = std::string("cannot be used: ") + std::strerror(trial.error);
    f.fixes = {shell(trial.error == ENOENT || trial.size_mb == 0 ? "sudo mount -t tmpfs tmpfs /dev/shm"
                     : trial.error == ENOSPC                     ? "sudo mount -o remount,size=1G /dev/shm"
                                                                 : "sudo chmod 1777 /dev/shm")};
    return f;
  }
  f.found += ", a file made and mapped";
  f.status = trial.free_mb >= kUsual ? Status::ok : Status::warn;
  if (f.status == Status::warn)
    f.fixes = {shell("sudo mount -o remount,size=1G /dev/shm"),
               {"/etc/fstab", "tmpfs /dev/shm tmpfs size=1G 0 0"},
               shell("docker run --shm-size=1g ...")};
  return f;
}

Finding check_transparent_hugepage(const Facts& facts) {
  Finding f{"memory", "transparent_hugepage", Need::advice, Status::ok, "", ""};
  f.meaning = "`always` lets the kernel join pages while a job uses them: it waits";
  const auto text = facts.text("/sys/kernel/mm/transparent_hugepage/enabled");
  f.found = text ? chosen_word(*text) : "not in this kernel";
  if (f.found == "always") {
    f.status = Status::warn;
    f.fixes = {shell("echo madvise | sudo tee /sys/kernel/mm/transparent_hugepage/enabled"),
               boot("transparent_hugepage=madvise")};
  } else if (f.found.empty()) {
    f.status = Status::unknown;
    f.found = "cannot be read";
  }
  return f;
}

Finding check_swap(const Facts& facts) {
  Finding f{"memory", "swap", Need::advice, Status::ok, "", ""};
  f.meaning = "jobs are locked; what others swap is disk traffic that delays all";
  const auto text = facts.text("/proc/swaps");
  if (!text) {
    f.status = Status::unknown;
    f.found = "/proc/swaps cannot be read";
    return f;
  }
  const auto devices = swap_devices(*text);
  f.found = devices.empty() ? "none" : "";
  for (const std::string& device : devices) f.found += (f.found.empty() ? "" : ", ") + device;
  if (devices.empty()) return f;
  f.status = Status::warn;
  f.fixes = {shell("sudo swapoff -a"), shell("sudo systemctl mask swap.target")};
  return f;
}

}  // namespace takt::machine
