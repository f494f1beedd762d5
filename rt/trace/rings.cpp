// SPDX-License-Identifier: Apache-2.0
#include "rt/trace/rings.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

namespace takt::trace {

Rings::Rings(size_t count) : count_(count), bytes_(sizeof(Shared) + sizeof(Ring) * count) {
  void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED)
    throw std::runtime_error("trace: shared memory of " + std::to_string(bytes_) + " bytes: " + std::strerror(errno));
  shared_ = new (memory) Shared;
  rings_ = reinterpret_cast<Ring*>(shared_ + 1);
  for (size_t i = 0; i < count; ++i) new (rings_ + i) Ring;
}

Rings::~Rings() { munmap(shared_, bytes_); }

Ring* Rings::claim(std::string_view name, int32_t imagined) {
  for (size_t i = 0; imagined == 0 && i < claimed(); ++i) {
    int32_t dead = rings_[i].writer.load();
    if (dead <= 0 || name.substr(0, rings_[i].name.size() - 1) != rings_[i].name.data()) continue;
    if (kill(dead, 0) != 0 && errno == ESRCH && rings_[i].writer.compare_exchange_strong(dead, gettid()))
      return &rings_[i];
  }
  const size_t index = shared_->next.fetch_add(1);
  if (index >= count_) return nullptr;
  Ring& ring = rings_[index];
  std::copy_n(name.data(), std::min(name.size(), ring.name.size() - 1), ring.name.data());
  ring.writer.store(imagined > 0 ? imagined : gettid(), std::memory_order_release);
  return &ring;
}

size_t Rings::claimed() const { return std::min(shared_->next.load(), count_); }

size_t Rings::refused() const {
  const size_t asked = shared_->next.load();
  return asked - std::min(asked, count_);
}

}  // namespace takt::trace
