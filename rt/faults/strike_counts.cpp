// SPDX-License-Identifier: Apache-2.0
#include "rt/faults/strike_counts.hpp"

#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

namespace takt::faults {
namespace {

template <class T>
std::span<T> place(std::byte*& at, size_t count) {
  T* first = reinterpret_cast<T*>(at);
  for (size_t i = 0; i < count; ++i) ::new (first + i) T{};
  at += sizeof(T) * count;
  return {first, count};
}

}  // namespace

StrikeCounts::StrikeCounts(size_t faults, size_t message_faults, size_t ports)
    : bytes_(sizeof(std::atomic<uint64_t>) * (faults + ports + 1) + sizeof(MessageFaultCount) * message_faults) {
  memory_ = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory_ == MAP_FAILED)
    throw std::runtime_error("counts of faults: shared memory of " + std::to_string(bytes_) +
                             " bytes: " + std::strerror(errno));
  auto* at = static_cast<std::byte*>(memory_);
  faults_ = place<std::atomic<uint64_t>>(at, faults);
  offered_ = place<std::atomic<uint64_t>>(at, ports);
  messages_ = place<MessageFaultCount>(at, message_faults);
}

StrikeCounts::~StrikeCounts() { munmap(memory_, bytes_); }

}  // namespace takt::faults
