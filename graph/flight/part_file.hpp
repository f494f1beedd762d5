// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>

namespace takt::flight {

/// NAME.part, which becomes NAME once it is whole. Unlike an OutputFile it goes on where an earlier process ended, and
/// stays if this one does. Errors: "FILE: REASON".
class PartFile {
 public:
  using Done = tl::expected<void, std::string>;

  static tl::expected<PartFile, std::string> open(const std::filesystem::path& file);
  PartFile(PartFile&& other) noexcept;
  PartFile& operator=(PartFile&&) = delete;
  ~PartFile();

  const std::filesystem::path& part() const { return part_; }
  uint64_t size() const { return size_; }
  Done append(std::span<const std::byte> data);
  Done shorten(uint64_t size);
  /// Gives it its name, once the disk has it.
  Done finish();

 private:
  PartFile(std::filesystem::path file, int descriptor);
  tl::unexpected<std::string> failed() const;

  std::filesystem::path file_, part_;
  int descriptor_;
  uint64_t size_ = 0;
};

}  // namespace takt::flight
