// SPDX-License-Identifier: Apache-2.0
#include "rt/file/lock_holder.hpp"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <string>

namespace takt {

std::optional<pid_t> lock_holder(const std::filesystem::path& file, const std::filesystem::path& locks) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return std::nullopt;
  std::array<char, 64> wanted{};
  std::snprintf(wanted.data(), wanted.size(), "%02x:%02x:%lu", major(status.st_dev), minor(status.st_dev),
                static_cast<unsigned long>(status.st_ino));
  std::ifstream in(locks);
  // 1: FLOCK  ADVISORY  WRITE 1234 fe:01:131090 0 EOF      ("->" after the number: one that waits)
  for (std::string number, kind, advisory, access, place, rest; in >> number >> kind;) {
    long pid = 0;
    if (kind == "->") {
      std::getline(in, rest);
      continue;
    }
    if (!(in >> advisory >> access >> pid >> place)) break;
    std::getline(in, rest);
    if (kind == "FLOCK" && place == wanted.data() && pid > 0) return static_cast<pid_t>(pid);
  }
  return std::nullopt;
}

}  // namespace takt
