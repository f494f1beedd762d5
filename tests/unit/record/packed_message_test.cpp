// SPDX-License-Identifier: Apache-2.0
#include "rt/record/packed_message.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <memory>
#include <new>

#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"

using namespace takt;
using namespace takt::record;

namespace {

using Bytes = std::vector<std::byte>;

/// A message placed in memory that was full of `poison` before: padding and unused elements stay so.
template <class T>
class Placed {
 public:
  explicit Placed(const Capacity& capacity, int poison = 0) {
    const MessageType& type = MessageType::of<T>();
    const size_t bytes = (type.bytes(capacity) + 63) / 64 * 64;
    memory_.reset(static_cast<std::byte*>(::operator new (bytes, std::align_val_t{64})));
    std::memset(memory_.get(), poison, bytes);
    type.place(memory_.get(), capacity);
  }
  T* operator->() { return std::launder(reinterpret_cast<T*>(memory_.get())); }
  void* get() { return memory_.get(); }
  Bytes packed() {
    Bytes bytes;
    pack(MessageType::of<T>(), memory_.get(), bytes);
    CHECK(bytes.size() == packed_bytes(MessageType::of<T>(), memory_.get()));
    return bytes;
  }

 private:
  struct Free {
    void operator()(std::byte* memory) const { ::operator delete (memory, std::align_val_t{64}); }
  };
  std::unique_ptr<std::byte, Free> memory_;
};

constexpr Capacity kPoints{0, 0, 1, 100};

void fill(Placed<PointCloud>& cloud) {
  cloud->step_px = 4;
  cloud->camera.focal_px = 500.25;
  for (int i = 0; i < 7; ++i) {
    cloud->points.push_back({0.1f * static_cast<float>(i), 2, -3});
    cloud->colours.push_back({1, 2, static_cast<uint8_t>(i)});
  }
}

const MessageType& cloud_type() { return MessageType::of<PointCloud>(); }

}  // namespace

TEST_CASE("packed message: what is packed is unpacked, into a message of another capacity as well") {
  Placed<PointCloud> cloud(kPoints), again({0, 0, 1, 7});
  fill(cloud);
  const Bytes bytes = cloud.packed();
  REQUIRE(unpack(cloud_type(), bytes, again.get()));
  CHECK(again->camera.focal_px == 500.25);
  CHECK(again->points.size == 7);
  CHECK(again->points[6].x == 0.1f * 6.0f);
  CHECK(again->colours[6].r == 6);
  CHECK(again.packed() == bytes);
  CHECK_FALSE(first_difference(cloud_type().fields, bytes, bytes));
}

TEST_CASE("packed message: neither padding nor unused elements are in it") {
  Placed<PointCloud> clean(kPoints, 0), dirty(kPoints, 0xa5);
  fill(clean);
  fill(dirty);
  CHECK(clean.packed() == dirty.packed());
  CHECK(clean.packed().size() < sizeof(PointCloud) + 7 * (sizeof(Point) + sizeof(Colour)) + 1);
}

TEST_CASE("packed message: a difference is named by field, element and values") {
  Placed<PointCloud> cloud(kPoints);
  fill(cloud);
  const Bytes before = cloud.packed();
  cloud->points[5].y = 2.5f;
  auto found = first_difference(cloud_type().fields, before, cloud.packed());
  REQUIRE(found);
  CHECK(found->field == "points[5]");
  CHECK(found->values == "2.5 instead of 2");
  CHECK(before[found->byte] != cloud.packed()[found->byte]);
  cloud->step_px = 5;  // earlier in the message
  found = first_difference(cloud_type().fields, before, cloud.packed());
  REQUIRE(found);
  CHECK(found->field == "step_px");
  CHECK(found->values == "5 instead of 4");
  cloud->step_px = 4;
  cloud->points.push_back({1, 2, 3});
  found = first_difference(cloud_type().fields, before, cloud.packed());
  REQUIRE(found);
  CHECK(found->field == "points.size");
  CHECK(found->values == "8 instead of 7");
}

TEST_CASE("packed message: bytes that are no message of the type are refused, wherever they end") {
  Placed<PointCloud> cloud(kPoints), again(kPoints);
  fill(cloud);
  const Bytes bytes = cloud.packed();
  for (size_t size = 0; size < bytes.size(); ++size) {
    CAPTURE(size);
    const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    CHECK_FALSE(unpack(cloud_type(), cut, again.get()));
    CHECK(first_difference(cloud_type().fields, bytes, cut));
    CHECK(first_difference(cloud_type().fields, cut, bytes));
  }
  Bytes longer = bytes;
  longer.push_back(std::byte{0});
  CHECK(unpack(cloud_type(), longer, again.get()).error().find("1 bytes too many") != std::string::npos);
  CHECK(first_difference(cloud_type().fields, bytes, longer)->field == "length");
  Placed<PointCloud> small({0, 0, 1, 6});
  CHECK(unpack(cloud_type(), bytes, small.get()).error() ==
        "point_cloud.points has 7 elements, and there is room for 6");
}
