// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

namespace takt::test {

/// Path of a real recording below TAKT_DATA (default ../shared/data beside the source tree). Where it is absent the
/// caller must return early; this function then says so on stderr, so that a skipped check is visible.
inline std::optional<std::filesystem::path> recording(const std::string& relative) {
  const char* root = std::getenv("TAKT_DATA");
  const std::filesystem::path path =
      (root ? std::filesystem::path(root) : std::filesystem::path(TAKT_SOURCE_DIR) / "../shared/data") / relative;
  if (std::filesystem::exists(path)) return path;
  std::cerr << "NOT RUN: recording " << path << " is absent (set TAKT_DATA)\n";
  return std::nullopt;
}

}  // namespace takt::test
