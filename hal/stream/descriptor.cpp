// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/descriptor.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

namespace takt {
namespace {

bool only_not_now() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

void Descriptor::close() {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

std::optional<size_t> Descriptor::read(std::span<uint8_t> into) const {
  if (into.empty()) return 0;
  const ssize_t got = ::read(fd_, into.data(), into.size());
  if (got > 0) return static_cast<size_t>(got);
  if (got < 0 && only_not_now()) return 0;
  return std::nullopt;
}

std::optional<size_t> Descriptor::write(std::span<const uint8_t> bytes) const {
  ssize_t taken = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (taken < 0 && errno == ENOTSOCK) taken = ::write(fd_, bytes.data(), bytes.size());
  if (taken >= 0) return static_cast<size_t>(taken);
  if (only_not_now()) return 0;
  return std::nullopt;
}

}  // namespace takt
