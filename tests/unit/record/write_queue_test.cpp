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
  std::vector<std::byte> image = filled({}, kImage);
  const std::byte* const memory = image.data();
  queue.recycle(std::move(image));
  CHECK(queue.buffer(kJob).capacity() == kJob);
  CHECK(queue.buffer(2 * kImage).data() != memory);
  const auto again = queue.buffer(kImage - 1);
  CHECK(again.data() == memory);
  CHECK(again.empty());
  CHECK(queue.buffer(kImage - 1).data() != memory);
}

TEST_CASE("new memory holds what is expected, in a few sizes") {
  WriteQueue queue(1);
  CHECK(queue.buffer(0).capacity() == 0);
  CHECK(queue.buffer(kImage).capacity() >= kImage);
  CHECK(queue.buffer(kImage).capacity() == queue.buffer(kImage + 10'000).capacity());
}

TEST_CASE("however many messages are popped at once, no more than so much of their memory is kept") {
  WriteQueue queue(1);
  for (int i = 0; i < 40; ++i) queue.recycle(filled({}, kImage));
  size_t kept = 0;  // whose capacity is that of the vectors above
  for (auto buffer = queue.buffer(kImage); buffer.capacity() == kImage; buffer = queue.buffer(kImage))
    kept += buffer.capacity();
  CHECK(kept > 0);
  CHECK(kept <= WriteQueue::kSpareBytes);
  std::vector<std::byte> job = filled({}, kJob);
  const std::byte* const memory = job.data();
  queue.recycle(std::move(job));
  CHECK(queue.buffer(kJob).data() == memory);
}

TEST_CASE("large messages that wait behind many others leave the heap, whole, and give their buffer back") {
  WriteQueue queue(64 << 20);
  const std::byte* memory = nullptr;
  for (size_t i = 0; i < 32; ++i) {
    std::vector<std::byte> image = queue.buffer(kImage);
    memory = image.data();
    image = filled(std::move(image), kImage);
    image.back() = std::byte(i);
    REQUIRE(queue.push({.sequence = i, .data = std::move(image)}, false));
  }
  CHECK(queue.buffer(kImage).data() == memory);
  size_t left = 0;
  for (size_t i = 0; i < 32; ++i) {
    auto entry = queue.pop();
    REQUIRE(entry);
    CHECK(entry->sequence == i);
    REQUIRE(entry->bytes().size() == kImage);
    CHECK(entry->bytes().back() == std::byte(i));
    left += entry->waited != nullptr;
    CHECK((entry->waited == nullptr) == (entry->data.size() == kImage));
    queue.recycle(std::move(entry->data));
  }
  CHECK(left == 32 - WriteQueue::kSpareBytes / kImage);
}

TEST_CASE("small messages wait in the heap, and what finds no room is lost") {
  WriteQueue queue(WriteQueue::kSpareBytes + 10 * kJob);
  REQUIRE(queue.push({.data = filled({}, WriteQueue::kSpareBytes)}, false));
  REQUIRE(queue.push({.data = filled({}, kJob)}, false));
  CHECK_FALSE(queue.push({.data = filled({}, kImage)}, false));
  CHECK(queue.pop()->waited == nullptr);
  CHECK(queue.pop()->waited == nullptr);
}
