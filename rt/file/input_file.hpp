// SPDX-License-Identifier: Apache-2.0
// Whether a path can be read as a file, asked before any reader has it:
//
//   if (const std::string why = why_unreadable(file); !why.empty()) return refuse(file.string() + " " + why);
//
// Streams open folders and fail at the first read, wait without an end for a pipe that nothing writes to, and read
// zeros from some devices until the memory is used up.
#pragma once
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace takt {

/// More than any picture, map or graph file has; a record may be larger.
constexpr uint64_t kLargestInput = uint64_t{16} << 30;

/// More than any text that is read line by line: lists, tables, logs.
constexpr uint64_t kLargestText = uint64_t{1} << 30;

/// Why `file` cannot be read: "is a folder, a file is expected", "is empty" ... ; "" if it can. What the shell hands
/// over (/dev/stdin, <(command)) can be read, a named pipe cannot. Opens nothing.
std::string why_unreadable(const std::filesystem::path& file, uint64_t most_bytes = kLargestInput);

/// The same of a folder whose files are to be read; one without any entry "is an empty folder".
std::string why_unreadable_folder(const std::filesystem::path& folder);

/// Throws Error with the path and why_unreadable(), unless it can be read.
template <class Error = std::runtime_error>
void require_readable(const std::filesystem::path& file, uint64_t most_bytes = kLargestText) {
  if (const std::string why = why_unreadable(file, most_bytes); !why.empty()) throw Error(file.string() + ": " + why);
}

}  // namespace takt
