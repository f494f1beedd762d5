// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

namespace takt {

/// Owns a file descriptor that does not block.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }
  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }
  void close();
  /// What is there, at most into.size() bytes; nothing at all at the end of the file and after an error.
  std::optional<size_t> read(std::span<uint8_t> into) const;
  /// What is taken; a connection that the other side has closed raises no signal.
  std::optional<size_t> write(std::span<const uint8_t> bytes) const;

 private:
  int fd_;
};

}  // namespace takt
