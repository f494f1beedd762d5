// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include "rt/capability.hpp"
#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"

namespace takt::machine {

Finding check_rights(const Facts& facts, const RightsTrial& trial) {
  Finding f{"policies", "rights", Need::advice, Status::ok, "", ""};
  f.meaning = "what this program may do; its workers keep CAP_SYS_NICE, others none";
  if (!trial.answered) return not_answered(f), f;
  if (facts.is_root()) {
    f.found = "root: all";
    f.meaning = "a run needs two of them: a service or a program of a group is enough";
    return f;
  }
  f.found = capabilities_text(trial.held);
  if (trial.by_file) f.found += ", by the program's file";
  else if (trial.held != 0) f.found += ", by who started it";
  if (trial.by_file && (trial.mode & S_IXOTH) != 0) {
    f.status = Status::warn;
    f.found += ", which every user of this machine may run";
    f.meaning = "any user gets real-time priority, and can hold up the machine";
    f.fixes = grant_rights(facts);
  }
  return f;
}

Finding check_watchdog(const WatchdogTrial& trial) {
  Finding f{"cores", "watchdog", Need::advice, Status::ok, "", ""};
  f.meaning = "resets the machine if it hangs: let systemd feed it, and Takt systemd";
  if (!trial.answered) return not_answered(f), f;
  if (!trial.there) {
    f.found = "no watchdog device";
    return f;
  }
  const std::string holder = trial.holder.data();
  f.found = std::string(trial.name.data()) + ", " + std::to_string(trial.timeout_s) + " s: ";
  if (!holder.empty()) {
    f.found += "held by " + holder;
  } else if (!trial.active) {
    f.found += "nobody holds it";
    f.fixes = {{"/etc/systemd/system.conf.d/takt.conf", "[Manager]\nRuntimeWatchdogSec=30s"}};
  } else if (trial.sees_all) {
    f.status = Status::warn;
    f.found += "armed, but nobody holds it: the machine is about to be reset";
    f.fixes = {{"/etc/systemd/system.conf.d/takt.conf", "[Manager]\nRuntimeWatchdogSec=30s"}};
  } else {
    f.found += "armed; only root sees who holds it";
  }
  return f;
}

}  // namespace takt::machine
