// SPDX-License-Identifier: Apache-2.0
// Who may write where in the pools of the local transport, and the order in which writer and reader look at each other.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <string>

#include "rt/shm/kill_order.hpp"
#include "rt/shm/local_transport.hpp"
#include "stray_store.hpp"
#include "transport_conformance.hpp"

using namespace takt;
using namespace takt::test;

namespace {

/// Does something when a step is reached the next time.
class AtStep {
 public:
  AtStep(MessageStep step, size_t port, std::function<void()> deed) {
    deed_ = std::move(deed);
    order_.port.store(static_cast<uint32_t>(port));
    order_.instead.store([](KillOrder&, std::byte*, size_t) { deed_(); });
    order_.step.store(step);
    obey_orders(&order_);
  }
  ~AtStep() { obey_orders(nullptr); }
  AtStep(const AtStep&) = delete;
  AtStep& operator=(const AtStep&) = delete;

 private:
  KillOrder order_;
  static inline std::function<void()> deed_;
};

/// A writer of which one half of a publication is done at a time.
class Halves {
 public:
  Halves(Transport& transport, size_t port) : writer_(transport.make_writer(port)) {}
  void step() {
    if (loaned_) writer_->publish(static_cast<int64_t>(value_), 0, 0);
    else fill(writer_->loan(), ++value_);
    loaned_ = !loaned_;
  }
  void steps(int count) {
    while (count-- > 0) step();
  }
  uint64_t published() const { return value_ - (loaned_ ? 1 : 0); }

 private:
  std::unique_ptr<Writer> writer_;
  uint64_t value_ = 0;
  bool loaned_ = false;
};

/// Begin and end of each.
std::map<uintptr_t, uintptr_t> writable_pools() {
  std::map<uintptr_t, uintptr_t> pools;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find("rw-s") == std::string::npos || line.find("memfd:takt") == std::string::npos) continue;
    const size_t dash = line.find('-');
    pools[std::stoull(line, nullptr, 16)] = std::stoull(line.substr(dash + 1), nullptr, 16);
  }
  return pools;
}

}  // namespace

TEST_CASE("no reader holds what the writer fills, whatever happens between its flag and its second look") {
  // Every order of the four steps at the head of local_pool.hpp: the writer does half publications before the reader
  // begins, between its two steps, and afterwards, until every chunk has come up again.
  constexpr size_t kPort = greedy;  // keeps one message, one reader may hold another
  int held_through = 0, found_gone = 0;
  for (int before = 2; before < 10; ++before)
    for (int between = 0; between < 10; ++between) {
      CAPTURE(before);
      CAPTURE(between);
      const auto transport = make_local_transport(conformance_ports());
      Halves writer(*transport, kPort);
      const auto reader = transport->make_reader(kPort);
      writer.steps(before);
      const uint64_t value = writer.published();
      Held held;
      {
        const AtStep at(MessageStep::inside_take, kPort, [&] { writer.steps(between); });
        held = reader->take(value);
      }
      CHECK(static_cast<bool>(held) == (writer.published() == value));
      held ? ++held_through : ++found_gone;
      for (int i = 0; i < 20; ++i) {
        writer.step();
        if (held) REQUIRE_MESSAGE(intact(held, value), "a held message must not be written over");
      }
      reader->release(held);
      CHECK(transport->chunks_in_use() <= 2);
    }
  CHECK(held_through > 0);
  CHECK(found_gone > 0);
}

TEST_CASE("a flag of a message that was gone is dropped again") {
  const auto transport = make_local_transport(conformance_ports());
  Halves writer(*transport, greedy);
  const auto reader = transport->make_reader(greedy);
  writer.steps(2);
  {
    const AtStep at(MessageStep::inside_take, greedy, [&] { writer.steps(2); });
    CHECK_FALSE(reader->take(1));
  }
  CHECK(transport->chunks_in_use() == 1);
}

TEST_CASE("the pool file keeps its size") {
  const PoolFile file;
  const auto made = make_local_transport(conformance_ports(), file);
  CHECK(fcntl(file.descriptor(), F_GET_SEALS) == (F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL));
  CHECK(ftruncate(file.descriptor(), 0) != 0);
  CHECK(ftruncate(file.descriptor(), static_cast<off_t>(file.bytes() * 2)) != 0);
  CHECK(file.bytes() == made->shared_memory_bytes());
}

TEST_CASE("messages can be written to by the process of their producer only") {
  const PoolFile file(3);
  const auto made = make_local_transport(conformance_ports(), file, 1);
  const auto writer = made->make_writer(basic);
  publish(*writer, 7, 1, 1);
  const auto store = [&](const char* where) {
    const auto joined = join_local_transport(conformance_ports(), file, 2);
    const auto reader = joined->make_reader(basic);
    Held held = reader->take(1);
    if (!held || !intact(held, 7)) _exit(0);
    const auto own = joined->make_writer(limits);  // which must not open more than its own port
    MessageHeader* mine = own->loan();
    if (mine == nullptr) _exit(0);
    *bytes_of(mine) = std::byte{1};
    const std::string what = where;
    if (what == "own") return;
    if (what == "message") *bytes_of(held.header) = std::byte{1};
    const uint64_t chunk = (conformance_ports()[limits].chunk_bytes() + 63) / 64 * 64 + 64;  // and its mark
    const uint64_t pool = conformance_ports()[limits].chunks() * chunk;
    const uint64_t pages = (pool + 4095) / 4096 * 4096;
    volatile std::byte* const first = bytes_of(mine) - mine->loan_offset;
    if (what == "behind") first[pages] = std::byte{1};
    if (what == "before") first[-1] = std::byte{1};
  };
  CHECK_FALSE(dies_of_a_store([&] { store("own"); }));
  CHECK(dies_of_a_store([&] { store("message"); }));
  CHECK(dies_of_a_store([&] { store("behind"); }));
  CHECK(dies_of_a_store([&] { store("before"); }));
  const auto reader = made->make_reader(basic);
  Held held = reader->take(1);
  CHECK(intact(held, 7));
}

TEST_CASE("the place of a dead writer can be taken") {
  const PoolFile file(3);
  const auto made = make_local_transport(conformance_ports(), file, 1);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const auto joined = join_local_transport(conformance_ports(), file, 2);
    const auto writer = joined->make_writer(basic);
    publish(*writer, 7, 1, 1);
    writer->loan();
    _exit(0);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(made->chunks_in_use() == 2);
  CHECK(made->reclaim(2) == 1);
  const auto successor = join_local_transport(conformance_ports(), file, 2);
  const auto reader = successor->make_reader(basic);
  Held kept = reader->take(1);
  CHECK(intact(kept, 7));
  const auto writer = successor->make_writer(basic);
  CHECK(writer->go_on_after(0) == 1);
  publish(*writer, 8, 2, 2);
  const auto elsewhere = made->make_reader(basic);
  CHECK(sequences(*elsewhere, kEver) == Sequences{2, 1});
}

TEST_CASE("processes have numbers within those of the file") {
  const PoolFile file(2);
  const auto made = make_local_transport(conformance_ports(), file, 2);
  CHECK_THROWS_AS(join_local_transport(conformance_ports(), file, 0), std::logic_error);
  CHECK_THROWS_AS(join_local_transport(conformance_ports(), file, 3), std::logic_error);
  CHECK(made->reclaim(3) == 0);
}

TEST_CASE("a process that has written over its flags takes nothing from others") {
  const PoolFile file(2);
  const auto made = make_local_transport(conformance_ports(), file, 1);
  const auto writer = made->make_writer(basic);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const auto before = writable_pools();
    const auto joined = join_local_transport(conformance_ports(), file, 2);
    for (const auto& [begin, end] : writable_pools())  // its flags: nothing else is writable to it
      if (before.count(begin) == 0) std::memset(reinterpret_cast<void*>(begin), 0xff, end - begin);
    _exit(0);
  }
  REQUIRE(waitpid(child, nullptr, 0) == child);
  CHECK(made->chunks_in_use() >= conformance_ports()[basic].chunks());
  const auto reader = made->make_reader(basic);
  for (int64_t i = 1; i <= 100; ++i) {
    publish(*writer, static_cast<uint64_t>(i), i, i);
    Held held = reader->take(static_cast<uint64_t>(i));
    REQUIRE(intact(held, static_cast<uint64_t>(i)));
    reader->release(held);
  }
  CHECK(writer->statistics().pool_empty == 0);
  made->reclaim(2);
  CHECK(made->chunks_in_use() <= conformance_ports()[basic].history);
}
