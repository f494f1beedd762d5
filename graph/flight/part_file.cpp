// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/part_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace takt::flight {

tl::expected<PartFile, std::string> PartFile::open(const std::filesystem::path& file) {
  const std::string part = file.string() + ".part";
  PartFile opened(file, ::open(part.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644));
  struct stat facts {};
  if (opened.descriptor_ < 0 || fstat(opened.descriptor_, &facts) != 0) return opened.failed();
  if (!S_ISREG(facts.st_mode)) return tl::unexpected(part + ": is no file");
  opened.size_ = static_cast<uint64_t>(facts.st_size);
  return opened;
}

PartFile::PartFile(std::filesystem::path file, int descriptor)
    : file_(std::move(file)), part_(file_.string() + ".part"), descriptor_(descriptor) {}

PartFile::PartFile(PartFile&& other) noexcept
    : file_(std::move(other.file_)),
      part_(std::move(other.part_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_) {}

PartFile::~PartFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

tl::unexpected<std::string> PartFile::failed() const {
  return tl::unexpected(part_.string() + ": " + std::strerror(errno));
}

PartFile::Done PartFile::append(std::span<const std::byte> data) {
  while (!data.empty()) {
    const ssize_t written = pwrite(descriptor_, data.data(), data.size(), static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return failed();
    data = data.subspan(static_cast<size_t>(written));
    size_ += static_cast<uint64_t>(written);
  }
  return {};
}

PartFile::Done PartFile::shorten(uint64_t size) {
  if (ftruncate(descriptor_, static_cast<off_t>(size)) != 0) return failed();
  size_ = size;
  return {};
}

PartFile::Done PartFile::finish() {
  if (fsync(descriptor_) != 0 || std::rename(part_.c_str(), file_.c_str()) != 0) return failed();
  const int folder = ::open(file_.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return {};
  fsync(folder);  // else a loss of power may take the new name away, not the file
  close(folder);
  return {};
}

}  // namespace takt::flight
