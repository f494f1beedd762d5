// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/mcap/file_sink.hpp>: record, experimental.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "rt/record/mcap/bytes.hpp"

namespace takt::mcap {

/// Where a file grows. One thread at a time.
class Sink {
 public:
  virtual ~Sink() = default;
  /// The parts one after the other, all of them or none: after an error (its text) the file ends where it ended before.
  virtual tl::expected<void, std::string> append(std::span<const Bytes> parts) = 0;
};

class FileSink final : public Sink {
 public:
  /// Creates the file, or empties it. Error: why it cannot be written.
  static tl::expected<FileSink, std::string> open(const std::filesystem::path& file);
  FileSink(FileSink&& other) noexcept;
  FileSink& operator=(FileSink&&) = delete;
  ~FileSink() override;
  tl::expected<void, std::string> append(std::span<const Bytes> parts) override;
  /// Waits until what was appended survives a loss of power. Error: the disk could not take it.
  tl::expected<void, std::string> settle() const;
  /// Error: nobody can find it any more, the file was deleted.
  tl::expected<void, std::string> still_there() const;

 private:
  explicit FileSink(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
  uint64_t size_ = 0;
};

}  // namespace takt::mcap
