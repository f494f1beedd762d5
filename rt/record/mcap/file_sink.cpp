// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/file_sink.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace takt::mcap {

tl::expected<FileSink, std::string> FileSink::open(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) return tl::unexpected(file.string() + ": " + std::strerror(errno));
  return FileSink(descriptor);
}

FileSink::FileSink(FileSink&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), size_(std::exchange(other.size_, 0)) {}

FileSink::~FileSink() {
  if (descriptor_ >= 0) close(descriptor_);
}

tl::expected<void, std::string> FileSink::append(std::span<const Bytes> parts) {
  uint64_t at = size_;
  for (const Bytes part : parts) {
    for (Bytes rest = part; !rest.empty();) {
      const ssize_t written = pwrite(descriptor_, rest.data(), rest.size(), static_cast<off_t>(at));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        const int reason = written < 0 ? errno : ENOSPC;
        // What cannot be taken back is cut off by readers: the record is not complete.
        [[maybe_unused]] const int kept = ftruncate(descriptor_, static_cast<off_t>(size_));
        return tl::unexpected(std::strerror(reason));
      }
      rest = rest.subspan(static_cast<size_t>(written));
      at += static_cast<uint64_t>(written);
    }
  }
  size_ = at;
  return {};
}

tl::expected<void, std::string> FileSink::settle() const {
  if (fdatasync(descriptor_) == 0 || errno == EINVAL) return {};  // EINVAL: nothing that could be lost, as a pipe
  return tl::unexpected(std::strerror(errno));
}

tl::expected<void, std::string> FileSink::still_there() const {
  struct stat file {};
  if (fstat(descriptor_, &file) == 0 && file.st_nlink > 0) return {};
  return tl::unexpected(std::string("the file was deleted"));
}

}  // namespace takt::mcap
