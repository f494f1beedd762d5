// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/pool_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <string>

#include "rt/machine/limits.hpp"

namespace takt {
namespace {

constexpr uint64_t kPage = 4096;
constexpr uint64_t pages(uint64_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }

[[noreturn]] void refuse(const std::string& what) { throw std::runtime_error(machine::explain(what, errno)); }

void* map_or_throw(void* at, uint64_t bytes, int protection, int flags, int file, uint64_t offset) {
  void* memory = mmap(at, bytes, protection, flags, file, static_cast<off_t>(offset));
  if (memory == MAP_FAILED)
    throw std::runtime_error(
        machine::explain("cannot map " + std::to_string(bytes / 1'000'000) + " MB of message pools", errno) +
        "; lower image sizes or edge depths, or free memory");
  return memory;
}

}  // namespace

PoolFile::PoolFile(uint32_t processes)
    : processes_(processes), writing_(memfd_create("takt", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  if (writing_ < 0) refuse("shared memory");
  reading_ = open(("/proc/self/fd/" + std::to_string(writing_)).c_str(), O_RDONLY | O_CLOEXEC);
  if (reading_ >= 0) return;
  const int why = errno;
  close(writing_);
  errno = why;
  refuse("shared memory cannot be opened for reading only (is /proc mounted?)");
}

PoolFile::~PoolFile() {
  close(reading_);
  close(writing_);
}

void PoolFile::resize(uint64_t bytes) const {
  // Its pages are touched next: beyond the limit the kernel would kill a process instead of refusing.
  if (const auto room = machine::memory_room(); room && static_cast<int64_t>(bytes) > *room)
    throw std::runtime_error("the message pools need " + std::to_string(bytes / 1'000'000) + " MB, " +
                             std::to_string(*room / 1'000'000) + " MB are left (" +
                             machine::limit_on(machine::Scarce::memory) + "); lower image sizes or edge depths");
  if (ftruncate(writing_, static_cast<off_t>(bytes)) != 0)
    refuse("shared memory of " + std::to_string(bytes) + " bytes");
  // Not against writing: a process that takes a dead one's place maps what that one wrote.
  if (fcntl(writing_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) refuse("sealing shared memory");
}

uint64_t PoolFile::bytes() const {
  struct stat status {};
  if (fstat(writing_, &status) != 0) refuse("shared memory");
  return static_cast<uint64_t>(status.st_size);
}

PoolMemory::Window::~Window() { munmap(memory_, bytes_); }

uint64_t PoolMemory::bytes(std::span<const uint64_t> parts) {
  uint64_t sum = 0;
  for (const uint64_t part : parts) sum += pages(part);
  return sum;
}

PoolMemory::PoolMemory(const PoolFile& file, std::span<const uint64_t> parts, Access access) : file_(file) {
  const uint64_t guard = access == Access::all ? 0 : kPage;
  uint64_t offset = 0, at = guard;
  for (const uint64_t bytes : parts) {
    parts_.push_back({offset, pages(bytes), at, access == Access::all});
    offset += pages(bytes);
    at += pages(bytes) + guard;
  }
  reserved_ = at;
  if (reserved_ == 0) return;
  if (access == Access::all) {
    memory_ = static_cast<std::byte*>(
        map_or_throw(nullptr, reserved_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file.descriptor(), 0));
    return;
  }
  memory_ = static_cast<std::byte*>(
      map_or_throw(nullptr, reserved_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
  try {
    for (const Part& part : parts_) map(part, false);
  } catch (...) {
    munmap(memory_, reserved_);
    throw;
  }
}

PoolMemory::~PoolMemory() {
  if (memory_ != nullptr) munmap(memory_, reserved_);
}

void PoolMemory::map(const Part& part, bool writable) const {
  if (part.bytes == 0) return;
  map_or_throw(memory_ + part.at, part.bytes, writable ? PROT_READ | PROT_WRITE : PROT_READ,
               MAP_SHARED | MAP_FIXED | MAP_POPULATE, writable ? file_.descriptor() : file_.for_reading(), part.offset);
}

void PoolMemory::allow_writing(size_t part) {
  if (parts_[part].writable) return;
  map(parts_[part], true);
  parts_[part].writable = true;
}

PoolMemory::Window PoolMemory::write(size_t part) const {
  const Part& of = parts_[part];
  return {map_or_throw(nullptr, of.bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_.descriptor(), of.offset), of.bytes};
}

}  // namespace takt
