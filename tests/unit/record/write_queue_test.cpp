// SPDX-License-Identifier: Apache-2.0
#include "rt/record/write_queue.hpp"

#include <doctest/doctest.h>

using takt::record::WriteQueue;

namespace {

constexpr size_t kImage = 2'000'000, kJob = 300;

std::vector<std::byte> filled(std::vector<std::byte> buffer, size_t bytes) {
  buffer.resize(bytes);
  return buffer;
}

}  // namespace

TEST_CASE("a message gets the memory of one of its size, not that of an image for a job") {
  WriteQueue queue(1);
  queue.recycle(filled({}, kImage));
  CHECK(queue.buffer(kJob).capacity() == 0);
  CHECK(queue.buffer(2 * kImage).capacity() == 0);
  const auto again = queue.buffer(kImage - 1);
  CHECK(again.capacity() >= kImage);
  CHECK(again.empty());
  CHECK(queue.buffer(kImage - 1).capacity() == 0);
}

TEST_CASE("however many messages are popped at once, no more than so much of their memory is kept") {
  WriteQueue queue(1);
  for (int i = 0; i < 40; ++i) queue.recycle(filled({}, kImage));
  size_t kept = 0;
  for (auto buffer = queue.buffer(kImage); buffer.capacity() > 0; buffer = queue.buffer(kImage))
    kept += buffer.capacity();
  CHECK(kept > 0);
  CHECK(kept <= WriteQueue::kSpareBytes);
  queue.recycle(filled({}, kJob));
  CHECK(queue.buffer(kJob).capacity() >= kJob);
}
