// SPDX-License-Identifier: Apache-2.0
// Internal to the checks: what several of them say alike.
#pragma once
#include <string>
#include <vector>

#include "rt/machine/facts.hpp"
#include "rt/machine/finding.hpp"

namespace takt::machine {

/// The kernel's configuration, from /proc/config.gz or /boot; "" if neither can be read.
std::string kernel_config(const Facts& facts);
/// Release of the running kernel.
std::string kernel_release(const Facts& facts);
/// All CPUs that are online.
std::vector<int> online_cpus(const Facts& facts);

/// The right to real-time policies and locked memory for this program: capabilities, or a unit of systemd.
std::vector<Fix> grant_rights(const Facts& facts);
/// Lines for a file of /etc/security/limits.d; "USER" stands for root, who needs none.
Fix limits_line(const Facts& facts, const std::string& item);
Fix boot(const std::string& options);
Fix shell(const std::string& command);

/// What a trial that gave no answer finds.
void not_answered(Finding& finding);

}  // namespace takt::machine
