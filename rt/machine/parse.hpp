// SPDX-License-Identifier: Apache-2.0
// How the kernel writes what the checks read. Pure functions on text; every one takes any text.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace takt::machine {

/// "0-2,5" -> 0 1 2 5, ascending; what is no list gives what could be read of it. CPU numbers up to 4095.
std::vector<int> parse_cpu_list(std::string_view text);
/// 0 1 2 5 -> "0-2,5".
std::string cpu_list_text(const std::vector<int>& cpus);

/// The chosen one of "always [madvise] never", also of "none voluntary (full)"; "" if none is marked.
std::string chosen_word(std::string_view text);

/// Value of CONFIG_`name` in a kernel configuration: "y", "250"; "n" where it says "is not set"; nothing if absent.
std::optional<std::string> kernel_option(std::string_view config, std::string_view name);
/// Value of `key=` on the kernel command line, the last one; nothing if absent.
std::optional<std::string> boot_option(std::string_view command_line, std::string_view key);

/// Major and minor number of a release "6.12.3-foo"; 0 0 if it is none.
struct KernelRelease {
  int major = 0, minor = 0;
  bool at_least(int wanted_major, int wanted_minor) const {
    return major != wanted_major ? major > wanted_major : minor >= wanted_minor;
  }
};
KernelRelease parse_release(std::string_view text);

/// Folder of the calling process in the hierarchy of `controller` ("" : the unified one of cgroup v2), from
/// /proc/self/cgroup; nothing if there is none.
std::optional<std::string> cgroup_path(std::string_view proc_cgroup, std::string_view controller);
/// Where that hierarchy is mounted, from /proc/self/mounts.
std::optional<std::string> cgroup_mount(std::string_view mounts, std::string_view controller);

/// Jiffies of the line "cpu  ..." of /proc/stat.
struct CpuTimes {
  int64_t total = 0, steal = 0;
};
std::optional<CpuTimes> parse_cpu_times(std::string_view proc_stat);

/// Swap devices of /proc/swaps.
std::vector<std::string> swap_devices(std::string_view proc_swaps);

/// A whole number at the beginning of the text.
std::optional<int64_t> parse_number(std::string_view text);

/// Value of the first line "key   : value" of a file of /proc; "" if there is none.
std::string line_value(std::string_view text, std::string_view key);

/// Without blanks at both ends.
std::string trimmed(std::string_view text);

/// Calls visit(line) for each line, without its end.
template <class Visitor>
void for_each_line(std::string_view text, const Visitor& visit) {
  while (!text.empty()) {
    const size_t end = text.find('\n');
    visit(text.substr(0, end));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
  }
}

/// Words of a line, separated by blanks; they point into it.
std::vector<std::string_view> words_of(std::string_view line);

}  // namespace takt::machine
