// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/parse.hpp"

#include <algorithm>
#include <charconv>

namespace takt::machine {
namespace {

constexpr std::string_view kBlank = " \t\r\n\f\v";
constexpr int kHighestCpu = 4095;

template <class Number>
std::optional<Number> number_at_start(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end == text.data()) return std::nullopt;
  return value;
}

bool lists(std::string_view comma_separated, std::string_view word) {
  while (true) {
    const size_t comma = comma_separated.find(',');
    if (comma_separated.substr(0, comma) == word) return true;
    if (comma == std::string_view::npos) return false;
    comma_separated.remove_prefix(comma + 1);
  }
}

}  // namespace

std::string trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(kBlank) - first + 1));
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const size_t end = line.find_first_of(kBlank, at);
    words.push_back(line.substr(at, end == std::string_view::npos ? end : end - at));
    at = end == std::string_view::npos ? end : line.find_first_not_of(kBlank, end);
  }
  return words;
}

std::optional<int64_t> parse_number(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos ? std::nullopt : number_at_start<int64_t>(text.substr(first));
}

std::vector<int> parse_cpu_list(std::string_view text) {
  std::vector<int> cpus;
  const std::string list = trimmed(text);
  for (std::string_view rest = list; !rest.empty();) {
    const std::string_view item = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), item.size() + 1));
    const auto first = number_at_start<int>(item);
    if (!first || *first < 0) continue;
    const size_t dash = item.find('-');
    const int last = dash == std::string_view::npos ? *first : number_at_start<int>(item.substr(dash + 1)).value_or(-1);
    for (int cpu = *first; cpu <= std::min(last, kHighestCpu); ++cpu) cpus.push_back(cpu);
  }
  std::sort(cpus.begin(), cpus.end());
  cpus.erase(std::unique(cpus.begin(), cpus.end()), cpus.end());
  return cpus;
}

std::string cpu_list_text(const std::vector<int>& cpus) {
  std::string text;
  for (size_t i = 0; i < cpus.size();) {
    size_t last = i;
    while (last + 1 < cpus.size() && cpus[last + 1] == cpus[last] + 1) ++last;
    if (!text.empty()) text += ',';
    text += std::to_string(cpus[i]);
    if (last > i) text += '-' + std::to_string(cpus[last]);
    i = last + 1;
  }
  return text;
}

std::string chosen_word(std::string_view text) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}}) {
    const size_t begin = text.find(open), end = text.find(close, begin == std::string_view::npos ? 0 : begin);
    if (begin != std::string_view::npos && end != std::string_view::npos)
      return std::string(text.substr(begin + 1, end - begin - 1));
  }
  return "";
}

std::optional<std::string> kernel_option(std::string_view config, std::string_view name) {
  const std::string set = "CONFIG_" + std::string(name) + "=", unset = "# CONFIG_" + std::string(name) + " is not set";
  std::optional<std::string> value;
  for_each_line(config, [&](std::string_view line) {
    if (line.substr(0, set.size()) == set) value = trimmed(line.substr(set.size()));
    else if (line.substr(0, unset.size()) == unset) value = "n";
  });
  return value;
}

std::optional<std::string> boot_option(std::string_view command_line, std::string_view key) {
  std::optional<std::string> value;
  for (const std::string_view word : words_of(command_line)) {
    if (word == "--") break;  // what follows belongs to init
    if (word.size() > key.size() && word.substr(0, key.size()) == key && word[key.size()] == '=')
      value = std::string(word.substr(key.size() + 1));
  }
  return value;
}

KernelRelease parse_release(std::string_view text) {
  KernelRelease release;
  const auto major = number_at_start<int>(text);
  const size_t dot = text.find('.');
  if (!major || dot == std::string_view::npos) return release;
  const auto minor = number_at_start<int>(text.substr(dot + 1));
  if (minor) release = {*major, *minor};
  return release;
}

std::optional<std::string> cgroup_path(std::string_view proc_cgroup, std::string_view controller) {
  // 4:cpu,cpuacct:/some/folder     0::/some/folder
  std::optional<std::string> path;
  for_each_line(proc_cgroup, [&](std::string_view line) {
    const size_t first = line.find(':'), second = first == std::string_view::npos ? first : line.find(':', first + 1);
    if (second == std::string_view::npos) return;
    const std::string_view controllers = line.substr(first + 1, second - first - 1);
    const bool mine = controller.empty() ? controllers.empty() : lists(controllers, controller);
    if (mine && !path) path = std::string(line.substr(second + 1));
  });
  return path;
}

std::optional<std::string> cgroup_mount(std::string_view mounts, std::string_view controller) {
  // cgroup /sys/fs/cgroup/cpu cgroup rw,relatime,cpu 0 0
  std::optional<std::string> folder;
  for_each_line(mounts, [&](std::string_view line) {
    const auto words = words_of(line);
    if (words.size() < 4 || folder) return;
    const bool mine = controller.empty() ? words[2] == "cgroup2" : words[2] == "cgroup" && lists(words[3], controller);
    if (mine) folder = std::string(words[1]);
  });
  return folder;
}

std::optional<CpuTimes> parse_cpu_times(std::string_view proc_stat) {
  constexpr size_t kSteal = 8, kLast = 8;  // user nice system idle iowait irq softirq steal; guest is part of user
  const auto words = words_of(proc_stat.substr(0, proc_stat.find('\n')));
  if (words.size() <= kSteal || words[0] != "cpu") return std::nullopt;
  CpuTimes times;
  for (size_t i = 1; i <= kLast; ++i) {
    const auto jiffies = number_at_start<int64_t>(words[i]);
    if (!jiffies) return std::nullopt;
    times.total += *jiffies;
    if (i == kSteal) times.steal = *jiffies;
  }
  return times;
}

std::vector<std::string> swap_devices(std::string_view proc_swaps) {
  std::vector<std::string> devices;
  for_each_line(proc_swaps, [&](std::string_view line) {
    const auto words = words_of(line);
    if (words.size() >= 3 && words[0] != "Filename") devices.emplace_back(words[0]);
  });
  return devices;
}

std::string line_value(std::string_view text, std::string_view key) {
  std::string value;
  bool found = false;
  for_each_line(text, [&](std::string_view line) {
    const size_t colon = line.find(':');
    if (found || colon == std::string_view::npos || trimmed(line.substr(0, colon)) != key) return;
    found = true;
    value = trimmed(line.substr(colon + 1));
  });
  return value;
}

}  // namespace takt::machine
