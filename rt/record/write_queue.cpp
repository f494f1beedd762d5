// SPDX-License-Identifier: Apache-2.0
#include "rt/record/write_queue.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "rt/memory/map_as_used.hpp"

namespace takt::record {

void Unmap::operator()(std::byte* memory) const { munmap(memory, bytes); }

std::vector<std::byte> WriteQueue::buffer(size_t expected_bytes) {
  constexpr size_t kSmall = 4096, kStep = kLarge;
  // New ones of equal size, in one piece: a heap that keeps its memory would be left with holes of all sizes.
  const auto fresh = [&] {
    std::vector<std::byte> buffer;
    buffer.reserve(expected_bytes <= kStep ? expected_bytes : (expected_bytes + kStep - 1) / kStep * kStep);
    return buffer;
  };
  std::unique_lock lock(mutex_);
  const auto fits = [&](size_t capacity) {
    return capacity >= expected_bytes && capacity <= 4 * std::max(expected_bytes, kSmall);
  };
  const auto found =
      std::find_if(spare_.begin(), spare_.end(), [&](const auto& spare) { return fits(spare.capacity()); });
  if (found == spare_.end()) {
    lock.unlock();
    return fresh();
  }
  std::swap(*found, spare_.back());
  std::vector<std::byte> buffer = std::move(spare_.back());
  spare_.pop_back();
  spare_bytes_ -= buffer.capacity();
  buffer.clear();
  return buffer;
}

bool WriteQueue::behind(size_t bytes) {
  const std::lock_guard lock(mutex_);
  return bytes_ + bytes > kSpareBytes && bytes_ + bytes <= most_bytes_;
}

bool WriteQueue::push(Entry entry, bool wait) {
  const size_t bytes = entry.data.size();
  if (!wait && bytes >= kLarge && behind(bytes)) {
    void* pages = map_as_used(bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS);
    if (pages != MAP_FAILED) {
      std::memcpy(pages, entry.data.data(), bytes);
      entry.waited = OwnPages(static_cast<std::byte*>(pages), Unmap{bytes});
      recycle(std::exchange(entry.data, {}));
    }
  }
  std::unique_lock lock(mutex_);
  if (wait) emptied_.wait(lock, [&] { return entries_.empty() || bytes_ + bytes <= most_bytes_; });
  if (!wait && bytes_ + bytes > most_bytes_) return false;
  bytes_ += bytes;
  entries_.push_back(std::move(entry));
  filled_.notify_one();
  return true;
}

std::optional<WriteQueue::Entry> WriteQueue::pop() {
  std::unique_lock lock(mutex_);
  filled_.wait(lock, [&] { return closed_ || !entries_.empty(); });
  if (entries_.empty()) return std::nullopt;
  Entry entry = std::move(entries_.front());
  entries_.pop_front();
  bytes_ -= entry.bytes().size();
  emptied_.notify_one();
  return entry;
}

void WriteQueue::recycle(std::vector<std::byte> buffer) {
  const std::lock_guard lock(mutex_);
  if (buffer.capacity() == 0 || spare_.size() == kBuffersKept || spare_bytes_ + buffer.capacity() > kSpareBytes) return;
  spare_bytes_ += buffer.capacity();
  spare_.push_back(std::move(buffer));
}

void WriteQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  filled_.notify_all();
}

}  // namespace takt::record
