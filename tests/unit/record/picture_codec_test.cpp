// SPDX-License-Identifier: Apache-2.0
#include "rt/record/picture_codec.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <random>

#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/record/packed_message.hpp"

namespace {

using namespace takt;
using namespace takt::record;
using Bytes = std::vector<std::byte>;

const MessageType& type() { return MessageType::of<StereoPair>(); }

struct Freed {
  void operator()(void* memory) const { ::operator delete (memory, std::align_val_t{64}); }
};

/// Two smooth pictures, packed; said to be of `said_width` columns.
Bytes packed_pair(int width, int height, int channels, int said_width) {
  const Capacity capacity{static_cast<uint32_t>(width), static_cast<uint32_t>(height), static_cast<uint32_t>(channels)};
  const std::unique_ptr<void, Freed> memory(::operator new (type().bytes(capacity), std::align_val_t{64}));
  type().place(memory.get(), capacity);
  auto& pair = *std::launder(static_cast<StereoPair*>(memory.get()));
  pair.width = said_width, pair.height = height, pair.channels = channels, pair.frame_number = 7;
  const auto bytes = static_cast<uint32_t>(width * height * channels);
  pair.left.resize(bytes), pair.right.resize(bytes);
  for (uint32_t i = 0; i < bytes; ++i) {
    const int pixel = static_cast<int>(i) / channels, x = pixel % width, y = pixel / width;
    pair.left[i] = static_cast<uint8_t>(128 + 60 * std::sin(x * 0.1) + 40 * std::cos(y * 0.07));
    pair.right[i] = static_cast<uint8_t>(x / 2 + y / 2);
  }
  Bytes packed;
  pack(type(), memory.get(), packed);
  return packed;
}

Bytes coded(const Bytes& packed, int quality) {
  PictureCoder coder(quality);
  Bytes kept;
  coder.code(type().fields, packed, kept);
  return kept;
}

}  // namespace

TEST_CASE("Pictures are kept as JPEG and come back nearly as they were, all else as it was") {
  for (const int channels : {1, 3})
    for (const int quality : {85, 95}) {
      CAPTURE(channels);
      CAPTURE(quality);
      const Bytes packed = packed_pair(320, 200, channels, 320), kept = coded(packed, quality);
      CHECK(kept.size() < packed.size() / 5);
      const auto again = plain_of(kept);
      REQUIRE_MESSAGE(again, again.error());
      REQUIRE(again->size() == packed.size());
      const size_t pixels = 2 * 320 * 200 * static_cast<size_t>(channels), head = packed.size() - pixels - 4;
      // Both counts lie in front of pixels: the second one between the pictures.
      CHECK(std::equal(packed.begin(), packed.begin() + static_cast<ptrdiff_t>(head), again->begin()));
      double difference = 0;
      for (size_t i = head; i < packed.size(); ++i)
        difference += std::abs(std::to_integer<int>(packed[i]) - std::to_integer<int>((*again)[i]));
      CHECK(difference / static_cast<double>(pixels) < 2);
      CHECK(difference > 0);
    }
}

TEST_CASE("A message whose fields fit no picture is kept to the byte") {
  const Bytes packed = packed_pair(64, 48, 1, 63);
  const auto again = plain_of(coded(packed, 85));
  REQUIRE(again);
  CHECK(*again == packed);
  CHECK(may_have_pictures(type().fields));
  CHECK(may_have_pictures(MessageType::of<Image>().fields));
  CHECK(!may_have_pictures(MessageType::of<LaserScan>().fields));
}

TEST_CASE("Damaged JPEG is told or read as something, and takes no memory that it does not fill") {
  const Bytes kept = coded(packed_pair(64, 48, 3, 64), 85);
  std::mt19937 chance(1);
  size_t told = 0;
  for (int i = 0; i < 2000; ++i) {
    Bytes damaged = kept;
    for (int n = 0; n < 1 + i % 3; ++n) damaged[chance() % damaged.size()] = static_cast<std::byte>(chance());
    if (i % 4 == 0) damaged.resize(chance() % damaged.size());
    const auto read = plain_of(damaged);
    told += read ? 0 : 1;
    if (read) CHECK(read->size() <= 1024 * damaged.size());
  }
  CHECK(told > 500);
}
