// SPDX-License-Identifier: Apache-2.0
#include "rt/file/input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace takt {
namespace {

/// Handed over by who started this program: opening it again takes nothing away from anybody.
bool handed_over(const std::filesystem::path& file) {
  const std::string name = file.lexically_normal().string();
  return name == "/dev/stdin" || name.starts_with("/dev/fd/") || name.starts_with("/proc/self/fd/");
}

std::string size_text(uint64_t bytes) {
  return bytes >= 10'000'000'000 ? std::to_string(bytes / 1'000'000'000) + " GB"
                                 : std::to_string(bytes / 1'000'000) + " MB";
}

}  // namespace

std::string why_unreadable(const std::filesystem::path& file, uint64_t most_bytes) {
  struct stat facts {};
  if (file.empty()) return "is no name of a file";
  if (stat(file.c_str(), &facts) != 0) return std::string("cannot be read: ") + std::strerror(errno);
  if (S_ISDIR(facts.st_mode)) return "is a folder, a file is expected";
  if (access(file.c_str(), R_OK) != 0) return std::string("cannot be read: ") + std::strerror(errno);
  if (S_ISREG(facts.st_mode)) {
    const auto bytes = static_cast<uint64_t>(facts.st_size);
    if (bytes > most_bytes)
      return "has " + size_text(bytes) + ", more than the " + size_text(most_bytes) + " to be read";
    return bytes == 0 ? "is empty" : "";
  }
  if (handed_over(file)) return "";
  if (S_ISFIFO(facts.st_mode)) return "is a named pipe, a file is expected; a command's output is given as <(command)";
  return S_ISSOCK(facts.st_mode) ? "is a socket, a file is expected" : "is a device, a file is expected";
}

std::string why_unreadable_folder(const std::filesystem::path& folder) {
  struct stat facts {};
  if (folder.empty()) return "is no name of a folder";
  if (stat(folder.c_str(), &facts) != 0) return std::string("cannot be read: ") + std::strerror(errno);
  if (!S_ISDIR(facts.st_mode)) return "is no folder, a folder is expected";
  if (access(folder.c_str(), R_OK | X_OK) != 0) return std::string("cannot be read: ") + std::strerror(errno);
  std::error_code unreadable;
  const bool empty = std::filesystem::is_empty(folder, unreadable);
  if (unreadable) return "cannot be read: " + unreadable.message();
  return empty ? "is an empty folder" : "";
}

}  // namespace takt
