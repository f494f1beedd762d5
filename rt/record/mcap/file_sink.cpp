// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/file_sink.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <utility>
#include <vector>

namespace takt::mcap {
namespace {

/// What is left of these after so many bytes.
std::span<iovec> behind(std::span<iovec> parts, size_t bytes) {
  while (!parts.empty() && bytes >= parts.front().iov_len) {
    bytes -= parts.front().iov_len;
    parts = parts.subspan(1);
  }
  if (!parts.empty()) {
    parts.front().iov_base = static_cast<std::byte*>(parts.front().iov_base) + bytes;
    parts.front().iov_len -= bytes;
  }
  return parts;
}

}  // namespace

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
  std::vector<iovec> rest;  // one call for all: each costs a slow disk as much again
  for (const Bytes part : parts)
    if (!part.empty()) rest.push_back({const_cast<std::byte*>(part.data()), part.size()});
  uint64_t at = size_;
  for (std::span left(rest); !left.empty();) {
    const auto count = static_cast<int>(std::min<size_t>(left.size(), IOV_MAX));
    const ssize_t written = pwritev(descriptor_, left.data(), count, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int reason = written < 0 ? errno : ENOSPC;
      // What cannot be taken back is cut off by readers: the record is not complete.
      [[maybe_unused]] const int kept = ftruncate(descriptor_, static_cast<off_t>(size_));
      return tl::unexpected(std::strerror(reason));
    }
    at += static_cast<uint64_t>(written);
    left = behind(left, static_cast<size_t>(written));
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
