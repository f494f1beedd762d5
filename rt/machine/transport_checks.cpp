// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"

namespace takt::machine {

Finding check_iceoryx(const DaemonTrial& trial) {
  Finding f{"transport", "iceoryx", Need::iceoryx, Status::lacks, "", ""};
  f.meaning = "`--transport iceoryx` starts one; a machine has room for one";
  if (!trial.answered) return not_answered(f), f;
  const std::string refused = trial.refused.data();
  if (refused.empty()) {
    f.status = Status::ok;
    f.found = "there is room for a daemon";
    return f;
  }
  f.found = refused;
  if (trial.private_room) {
    f.status = Status::warn;
    f.meaning = "such a run takes a /tmp and /dev/shm of its own and goes on";
  } else {
    f.fixes = {shell("takt run --isolate none")};
  }
  return f;
}

}  // namespace takt::machine
