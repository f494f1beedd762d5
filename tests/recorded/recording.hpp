// SPDX-License-Identifier: Apache-2.0
// Files of real recordings, for tests/recorded only: their main (main.cpp) skips a program where there are none at all.
#pragma once
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace takt::test {

/// TAKT_DATA, or ../shared/data next to the source tree.
inline std::filesystem::path data_folder() {
  const char* root = std::getenv("TAKT_DATA");
  return root != nullptr && *root != '\0' ? std::filesystem::path(root)
                                          : std::filesystem::path(TAKT_SOURCE_DIR) / "../shared/data";
}

/// A file or folder of the data folder. The test case fails, with the path, where it is missing.
inline std::filesystem::path recording(const std::string& relative) {
  std::filesystem::path path = data_folder() / relative;
  if (!std::filesystem::exists(path)) FAIL(path.string(), " is missing (TAKT_DATA names the folder of recordings)");
  return path;
}

/// A file of the collection of reference vectors, the folder `reference` next to the data folder.
inline std::filesystem::path reference(const std::string& relative) { return recording("../reference/" + relative); }

}  // namespace takt::test
