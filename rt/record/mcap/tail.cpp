// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/tail.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "rt/record/mcap/chunks.hpp"

namespace takt::mcap {
namespace {

/// More than a record of a ring's file has; a length that is none would take all memory.
constexpr uint64_t kMostBytes = uint64_t{1} << 28;

}  // namespace

tl::expected<Tail, std::string> Tail::open(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return tl::unexpected(file.string() + ": " + std::strerror(errno));
  return Tail(descriptor);
}

Tail::Tail(Tail&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), at_(other.at_), buffer_(std::move(other.buffer_)) {}

Tail& Tail::operator=(Tail&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(at_, other.at_);
  std::swap(buffer_, other.buffer_);
  return *this;
}

Tail::~Tail() {
  if (descriptor_ >= 0) close(descriptor_);
}

/// Into the buffer; false: not all of it is there.
bool Tail::read(uint64_t at, uint64_t size) {
  struct stat facts {};
  if (fstat(descriptor_, &facts) != 0 || static_cast<uint64_t>(facts.st_size) < at + size) return false;
  buffer_.resize(static_cast<size_t>(size));
  for (size_t done = 0; done < buffer_.size();) {
    const ssize_t got = pread(descriptor_, buffer_.data() + done, buffer_.size() - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    done += static_cast<size_t>(got);
  }
  return true;
}

tl::expected<std::optional<Tail::Record>, std::string> Tail::next() {
  if (at_ == 0) {
    if (!read(0, kMagic.size())) return std::nullopt;
    if (std::memcmp(buffer_.data(), kMagic.data(), kMagic.size()) != 0)
      return tl::unexpected(std::string("it is no MCAP file"));
    at_ = kMagic.size();
  }
  if (!read(at_, kHead)) return std::nullopt;
  ByteReader head(buffer_);
  const auto op = static_cast<Op>(head.number<uint8_t>());
  const auto length = head.number<uint64_t>();
  if (op < Op::header || op > Op::data_end || length > kMostBytes)
    return tl::unexpected("at byte " + std::to_string(at_) + " there is no record");
  if (!read(at_ + kHead, length)) return std::nullopt;
  return Record{op, buffer_, std::exchange(at_, at_ + kHead + length)};
}

}  // namespace takt::mcap
