// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/facts.hpp"

#include <pwd.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>

namespace takt::machine {

std::optional<std::string> SystemFacts::text(const std::string& path) const {
  // zlib reads plain files as they are; files of /proc have no size, so they are read to their end.
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "re"), gzclose);
  if (!file) return std::nullopt;
  std::string text;
  std::array<char, 16384> buffer{};
  while (text.size() < kLargestFact) {
    const int read = gzread(file.get(), buffer.data(), buffer.size());
    if (read < 0) return std::nullopt;
    if (read == 0) break;
    text.append(buffer.data(), static_cast<size_t>(read));
  }
  return text;
}

std::vector<std::string> SystemFacts::list(const std::string& folder) const {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    names.push_back(it->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<int> SystemFacts::allowed_cpus() const {
  std::vector<int> cpus;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0) return cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(static_cast<size_t>(cpu), &set)) cpus.push_back(cpu);
  return cpus;
}

std::optional<int64_t> SystemFacts::limit(int resource) const {
  rlimit found{};
  if (getrlimit(static_cast<__rlimit_resource_t>(resource), &found) != 0 || found.rlim_cur == RLIM_INFINITY)
    return std::nullopt;
  return static_cast<int64_t>(found.rlim_cur);
}

bool SystemFacts::is_root() const { return geteuid() == 0; }

std::string SystemFacts::user() const {
  std::array<char, 1024> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(geteuid(), &entry, buffer.data(), buffer.size(), &found) == 0 && found != nullptr)
    return found->pw_name;
  return std::to_string(geteuid());
}

std::string SystemFacts::program() const {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "takt" : program.string();
}

}  // namespace takt::machine
