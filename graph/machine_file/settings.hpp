// SPDX-License-Identifier: Apache-2.0
// A machine file as what Debian reads: words of the kernel's command line, and files of udev, systemd and tmpfiles.
//
//   for (const SystemFile& file : system_files(machine)) fmt::print("{}:\n{}", file.path, file.content);
#pragma once
#include <string>
#include <vector>

#include "graph/machine_file/machine_file.hpp"

namespace takt::graph {

/// One file of a system, or a link.
struct SystemFile {
  std::string path;  ///< absolute
  std::string content;
  std::string link = {};   ///< what it points to, if it is one
  std::string after = {};  ///< the command that lets it take effect without a restart; "": the next start
};

/// "nohz_full=2-3", "rcu_nocbs=2-3", "irqaffinity=0-1" ... in a fixed order. CPUs are not taken out of the scheduler's
/// sight (isolcpus): a service would no longer have them in its mask, and SCHED_DEADLINE refuses a part of all CPUs.
std::vector<std::string> kernel_arguments(const MachineFile& machine);

/// All files but that of the command line, by path. What the file does not mention is not among them.
std::vector<SystemFile> system_files(const MachineFile& machine);

/// That of the command line, where GRUB's own scripts of Debian begin Linux.
SystemFile grub_file(const MachineFile& machine);

}  // namespace takt::graph
