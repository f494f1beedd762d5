// SPDX-License-Identifier: Apache-2.0
#include "rt/record/faulty_sink.hpp"

#include <doctest/doctest.h>

#include <array>

namespace {

using namespace takt;
constexpr int64_t kSecond = 1'000'000'000;

struct Counting final : mcap::Sink {
  uint64_t bytes = 0;
  tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override {
    for (const mcap::Bytes part : parts) bytes += part.size();
    return {};
  }
};

struct Disk {
  Counting file;
  VirtualClock clock{kSecond};
  std::atomic<int64_t> epoch{kSecond};
  std::atomic<uint64_t> struck{0};
  int64_t waited_ns = 0;
  record::FaultySink sink;
  explicit Disk(const record::DiskFault& fault)
      : sink(file, {fault}, clock, epoch, {&struck}, [this](int64_t ns) { waited_ns += ns; }) {}
  bool append(size_t bytes) {
    const std::vector<std::byte> data(bytes);
    const std::array<mcap::Bytes, 1> parts{mcap::Bytes(data)};
    return static_cast<bool>(sink.append(parts));
  }
};

}  // namespace

TEST_CASE("a slow disk takes its time for each byte, within its window") {
  record::DiskFault fault;
  fault.from_ns = kSecond;
  fault.to_ns = 2 * kSecond;
  fault.bytes_per_s = 1000;
  Disk disk(fault);
  CHECK(disk.append(500));
  CHECK(disk.waited_ns == 0);
  disk.clock.advance_to(2 * kSecond);
  CHECK(disk.append(500));
  CHECK(disk.waited_ns == kSecond / 2);
  disk.clock.advance_to(3 * kSecond);
  CHECK(disk.append(500));
  CHECK(disk.waited_ns == kSecond / 2);
  CHECK(disk.struck == 1);
  CHECK(disk.file.bytes == 1500);
}

TEST_CASE("what a slow disk still holds when it is fast again is written at once") {
  record::DiskFault fault;
  fault.to_ns = 2 * kSecond;
  fault.bytes_per_s = 1000;
  Disk disk(fault);
  disk.clock.advance_to(2 * kSecond);  // a second after the epoch, another one before the window's end
  CHECK(disk.append(1'000'000));
  CHECK(disk.waited_ns == kSecond);
}

TEST_CASE("a full disk refuses what does not fit, whole, and takes it again when there is room") {
  record::DiskFault fault;
  fault.to_ns = kSecond;
  fault.room_bytes = 1000;
  Disk disk(fault);
  CHECK(disk.append(600));
  CHECK_FALSE(disk.append(600));
  CHECK(disk.file.bytes == 600);
  CHECK(disk.append(400));
  CHECK_FALSE(disk.append(1));
  CHECK(disk.struck == 2);
  disk.clock.advance_to(2 * kSecond);
  CHECK(disk.append(600));
}

TEST_CASE("no disk fails before the run has an epoch") {
  record::DiskFault fault;
  fault.room_bytes = 0;
  Disk disk(fault);
  disk.epoch = 0;
  CHECK(disk.append(10));
}
