// SPDX-License-Identifier: Apache-2.0
// Messages with arbitrary contents: each has no form, or forms that their definitions describe to the last byte.
// Nothing beyond what a message uses is read: the forms do not change with the bytes that its arrays leave free, and
// the memory behind the message cannot be read at all.
#include <doctest/doctest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <random>

#include "graph/world/encoder.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/joint_state.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/layout.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/node_state.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/requests.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "tests/property_scale.hpp"
#include "tests/unit/world/ros_reader.hpp"

using namespace takt;

namespace {

/// Memory whose end is that of a page behind which there is nothing.
class GuardedBytes {
 public:
  explicit GuardedBytes(size_t bytes) : bytes_(bytes) {
    const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
    mapped_ = (bytes + page - 1) / page * page + page;
    base_ = static_cast<std::byte*>(mmap(nullptr, mapped_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    REQUIRE(base_ != MAP_FAILED);
    REQUIRE(mprotect(base_ + mapped_ - page, page, PROT_NONE) == 0);
    at_ = base_ + mapped_ - page - bytes;
  }
  ~GuardedBytes() { munmap(base_, mapped_); }
  GuardedBytes(const GuardedBytes&) = delete;
  GuardedBytes& operator=(const GuardedBytes&) = delete;
  std::byte* data() { return at_; }
  std::span<std::byte> all() { return {at_, bytes_}; }

 private:
  size_t bytes_, mapped_ = 0;
  std::byte *base_ = nullptr, *at_ = nullptr;
};

using Random = std::mt19937;
uint32_t up_to(Random& random, uint32_t most) { return std::uniform_int_distribution<uint32_t>(0, most)(random); }

/// A number as it may be there: any bits, or a small one that a size could be.
void draw(Random& random, Scalar scalar, std::byte* at) {
  const auto number = up_to(random, 7) > 0 ? static_cast<int>(up_to(random, 8)) - 1 : static_cast<int>(random());
  visit_scalar(scalar, at, [&](auto value) {
    value = static_cast<decltype(value)>(number);
    if (up_to(random, 7) == 0)
      for (size_t i = 0; i < sizeof value; ++i) reinterpret_cast<uint8_t*>(&value)[i] = static_cast<uint8_t>(random());
    std::memcpy(at, &value, sizeof value);
  });
}

/// Fills what a message uses, or what its arrays leave free.
void fill(Random& random, const MessageType& type, std::byte* message, bool used) {
  for (const Field& field : type.fields) {
    std::byte* at = message + field.offset;
    if (!field.is_array()) {
      if (used)
        for (uint32_t i = 0; i < field.count; ++i) draw(random, field.scalar, at + i * scalar_bytes(field.scalar));
      continue;
    }
    auto& array = *reinterpret_cast<Array<std::byte>*>(at);
    if (used) array.size = up_to(random, 2) == 0 ? array.capacity : up_to(random, array.capacity);
    const size_t middle = size_t{array.size} * field.element_bytes, end = size_t{array.capacity} * field.element_bytes;
    for (size_t i = used ? 0 : middle; i < (used ? middle : end); ++i)
      array.data()[i] = static_cast<std::byte>(random());
  }
}

struct Counted {
  int forms = 0, unsound = 0;
};

void check_message(Random& random, const MessageType& type, bool size_is_limit, Counted& counted) {
  const Capacity capacity{up_to(random, 7), up_to(random, 7), up_to(random, 3), up_to(random, 7)};
  GuardedBytes memory(type.bytes(capacity));
  type.place(memory.data(), capacity);
  fill(random, type, memory.data(), true);
  const bool sound = type.intact(memory.data(), capacity);
  const world::Encoder encoder({.jpeg_quality = static_cast<int>(up_to(random, 1) * 75)});
  const auto stamp_ns = static_cast<int64_t>((uint64_t{random()} << 32U) | random());
  const auto forms = encoder.forms(type, memory.data(), "node", stamp_ns);
  counted.unsound += sound ? 0 : 1;
  if (!sound) {
    CHECK(forms.empty());
    return;
  }
  if (size_is_limit) fill(random, type, memory.data(), false);
  const auto again = encoder.forms(type, memory.data(), "node", stamp_ns);
  REQUIRE(again.size() == forms.size());
  for (size_t i = 0; i < forms.size(); ++i) {
    CAPTURE(forms[i].schema);
    CHECK(again[i].topic == forms[i].topic);
    CHECK(again[i].bytes == forms[i].bytes);
    CHECK_NOTHROW(test::RosReader(world::schema_text(forms[i].schema, type.fields)).read(forms[i].bytes));
    ++counted.forms;
  }
}

template <class... T>
Counted check_each(int rounds) {
  Counted all;
  const auto check = [&](const MessageType& type, bool size_is_limit) {
    CAPTURE(type.name);
    Random random(static_cast<Random::result_type>(test::seed(17)));
    Counted counted;
    for (int round = 0; round < rounds; ++round) check_message(random, type, size_is_limit, counted);
    CHECK(counted.forms >= test::at_scale(10));
    all.forms += counted.forms, all.unsound += counted.unsound;
  };
  (check(
       MessageType::of<T>(), !requires(const T& message) { message.sound(); }),
   ...);
  return all;
}

}  // namespace

TEST_CASE("A message with arbitrary contents has forms that are what they say, made of nothing but what it uses") {
  const Counted counted =
      check_each<ActionCommand, ActionOutcome, BodyPoses, Detections, DigitalState, DisparityMap, Grid, HeadCommand,
                 HeadState, Image, JointState, LaserScan, Motion, NodeState, ObjectReports, Objects3d, Odometry,
                 PointCloud, Pose, Requests, RobotTask, StereoPair, StopCommand, Terrain, TextStatus, VelocityCommand>(
          test::rounds(400));
  CHECK(counted.forms > test::at_scale(4000));
  CHECK(counted.unsound > test::at_scale(200));
}
