// SPDX-License-Identifier: Apache-2.0
// What a process writes where it should not, in pools of its own: withheld and named if it is seen before publication,
// lost to its readers afterwards. Nobody else ends.
#include <doctest/doctest.h>

#include <cstring>
#include <string>

#include "commit_scene.hpp"
#include "rt/msg/image.hpp"

using namespace takt;
using namespace takt::test;

namespace {

constexpr size_t kOdometryEnd = (sizeof(Odometry) + 63) / 64 * 64;

/// Both outputs of a job, of which something can be written over before they are sent.
struct Overrunner final : Node {
  Output<Odometry> a{this, "a", ""}, b{this, "b", ""};
  std::function<void(std::byte* message)> spoil_b = [](std::byte*) {};
  void setup(Setup&) override {}
  void run(Job& job) override {
    for (Output<Odometry>* output : {&a, &b}) {
      Odometry* message = output->loan();
      REQUIRE(message != nullptr);
      message->x_m = static_cast<double>(job.index());
      if (output == &b) spoil_b(reinterpret_cast<std::byte*>(message));
      output->send(job.release_ns());
    }
  }
};

std::string fault_of(const RunBoard& board) {
  if (board.faults().size() == 0) return "";
  CHECK(board.faults().at(0)->kind == Fault::damaged);
  return std::string(board.faults().at(0)->what.text());
}

}  // namespace

TEST_CASE("a job that writes past its message: all its outputs are withheld, and it is named") {
  Overrunner node;
  const Plan plan = pair_plan(node);
  RunBoard board(plan);
  VirtualClock clock(kEpoch);
  const auto transport = make_local_transport(plan.ports);
  Task task(plan, 0, *transport, clock, board);
  const PairReaders readers(*transport, board, clock);
  const auto run = [&](uint64_t index) {
    task.run(index, clock.now_ns());
    task.count(0);
    clock.advance_to(clock.now_ns() + 10 * kMs);
  };
  run(0);
  CHECK(board.faults().size() == 0);
  for (const size_t at : {kOdometryEnd, kOdometryEnd + 63}) {
    CAPTURE(at);
    node.spoil_b = [&](std::byte* message) { message[at] ^= std::byte{1}; };
    run(1);
    CHECK(fault_of(board) ==
          "pair.b: job 1 wrote past its message or over its structure; the outputs of the job are withheld");
  }
  node.spoil_b = [](std::byte*) {};
  run(2);
  const std::vector<SeenMessage> seen = look_at(*readers.a, clock.now_ns());
  REQUIRE(seen.size() == 2);
  CHECK(seen[0].job == 2);
  CHECK(seen[0].sequence == 2);  // nobody counts a message as dropped that never was
  CHECK(look_at(*readers.b, clock.now_ns()) == seen);
  CHECK(board.task(0).no_result == 2);
  CHECK(board.task(0).completed == 4);
  CHECK(board.faults().size() == 2);
  CHECK(transport->chunks_in_use() == 4);
}

TEST_CASE("a message that was written over after its publication is lost to its readers, once each") {
  const std::vector<PortPlan> ports{{"camera", "image", &MessageType::of<Image>(), {8, 6, 1, 0}, 4, 4, 1}};
  const auto transport = make_local_transport(ports);
  const auto writer = transport->make_writer(0);
  const auto publish = [&](int64_t stamp_ns) {
    MessageHeader* header = writer->loan();
    REQUIRE(header != nullptr);
    auto& image = *reinterpret_cast<Image*>(header + 1);
    image.width = 8, image.height = 6, image.channels = 1;
    CHECK(writer->intact());
    writer->publish(stamp_ns, stamp_ns, stamp_ns);
    return reinterpret_cast<std::byte*>(header);
  };
  const size_t chunk = (ports[0].chunk_bytes() + 63) / 64 * 64;
  const auto reader = transport->make_reader(0);
  uint64_t lost = 0;
  for (const size_t at : {offsetof(MessageHeader, loan_offset), sizeof(MessageHeader) + offsetof(Image, pixels),
                          sizeof(MessageHeader) + offsetof(Image, height), chunk}) {
    CAPTURE(at);
    std::byte* message = publish(1);
    const uint64_t sequence = writer->statistics().sent;
    Held held = reader->take(sequence);
    CHECK(held);
    reader->release(held);
    message[at] ^= std::byte{0x40};
    CHECK_FALSE(reader->take(sequence));
    CHECK_FALSE(reader->take(sequence));
    CHECK(reader->damaged() == ++lost);
    message[at] ^= std::byte{0x40};
  }
  CHECK(transport->chunks_in_use() == lost);
}
