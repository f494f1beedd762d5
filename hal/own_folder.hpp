// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "hal/stream/descriptor.hpp"

namespace takt::hal {

/// A folder of this process, gone with this object. One whose process was killed goes when the next one is made: each
/// is locked as long as somebody has it.
class OwnFolder {
 public:
  /// Below `parent`, its name `prefix` and six letters. path() is empty if that failed.
  OwnFolder(const std::filesystem::path& parent, const std::string& prefix);
  ~OwnFolder();
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  Descriptor lock_;
};

}  // namespace takt::hal
