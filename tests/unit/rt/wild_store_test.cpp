// SPDX-License-Identifier: Apache-2.0
// Stores of one process at random places of the pools: what other processes produce stays as it is, none of them ends,
// and whoever takes the place of the wild one goes on.
#include <doctest/doctest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "rt/shm/commit_ring.hpp"
#include "rt/shm/local_transport.hpp"
#include "transport_conformance.hpp"

using namespace takt;
using namespace takt::test;

namespace {

constexpr size_t kOurs[] = {basic, repeats, late}, kTheirs[] = {limits, deep, model_5};
constexpr uint32_t kStores = 200;

struct Range {
  std::byte* begin;
  std::byte* end;
  bool writable;
};

/// Where this process has the pools mapped, in the order of addresses.
std::vector<Range> pools_in_memory() {
  std::vector<Range> ranges;
  FILE* maps = std::fopen("/proc/self/maps", "r");
  REQUIRE(maps != nullptr);
  char line[512], rights[5];
  for (uintptr_t begin = 0, end = 0; std::fgets(line, sizeof(line), maps) != nullptr;)
    if (std::strstr(line, "/memfd:takt") != nullptr &&
        std::sscanf(line, "%" SCNxPTR "-%" SCNxPTR " %4s", &begin, &end, rights) == 3)
      ranges.push_back({reinterpret_cast<std::byte*>(begin), reinterpret_cast<std::byte*>(end), rights[1] == 'w'});
  std::fclose(maps);
  REQUIRE(!ranges.empty());
  return ranges;
}

/// What a process whose memory this is may write: its flags, and the pools of its producers.
std::vector<std::byte> own_bytes(const std::vector<Range>& ranges) {
  std::vector<std::byte> bytes;
  for (const Range& range : ranges)
    if (range.writable) bytes.insert(bytes.end(), range.begin, range.end);
  return bytes;
}

/// 4 bytes to 1 MB of zeros, ones or noise, anywhere from the first to the last byte of the pools; every second time
/// in what may be written, since most other stores end this process at their first byte.
[[noreturn]] void store_somewhere(std::mt19937_64& random) {
  std::vector<Range> ranges = pools_in_memory();
  Range range{ranges.front().begin, ranges.back().end, true};
  if (random() % 2 == 0) {
    std::erase_if(ranges, [](const Range& r) { return !r.writable; });
    range = ranges[random() % ranges.size()];
  }
  signal(SIGSEGV, SIG_DFL);
  const uint64_t kind = random() % 3, most = uint64_t{4} << random() % 19;
  std::byte* at = range.begin + random() % static_cast<uint64_t>(range.end - range.begin);
  for (uint64_t left = most; left > 0; --left, ++at)
    *const_cast<volatile std::byte*>(at) = kind == 0 ? std::byte{0} : kind == 1 ? std::byte{0xff} : std::byte(random());
  _exit(0);
}

/// A process that takes the place of the one before, settles what that left, publishes, loans once more, and stores.
void wild_process(const PoolFile& file, uint32_t seed) {
  for (const Range& inherited : pools_in_memory())
    munmap(inherited.begin, static_cast<size_t>(inherited.end - inherited.begin));
  std::mt19937_64 random(seed);
  const auto transport = join_local_transport(conformance_ports(), file, 2);
  std::vector<std::unique_ptr<Writer>> writers;
  std::vector<std::unique_ptr<Reader>> readers;
  for (const size_t port : kOurs) {
    readers.push_back(transport->make_reader(port));
    for (const Candidate& candidate : listed(*readers.back(), kEver, 1)) readers.back()->take(candidate.sequence);
  }
  for (const size_t port : kTheirs) {
    writers.push_back(transport->make_writer(port));
    writers.back()->settle(1, seed % 2 == 0 ? 1 : CommitRing::kNever);
    for (uint32_t i = 0; i < 3; ++i)
      if (writers.back()->loan() != nullptr) writers.back()->announce(seed, 1, 0);
    writers.back()->loan();
  }
  store_somewhere(random);
}

/// How a child that does that ends; one that goes on for ever ends after 2 s of CPU time.
int end_of(const std::function<void()>& deed) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const rlimit none{0, 0}, cpu{2, 2};
    setrlimit(RLIMIT_CORE, &none);
    setrlimit(RLIMIT_CPU, &cpu);
    signal(SIGSEGV, [](int) { _exit(2); });  // not of its own store
    try {
      deed();
    } catch (...) {
    }
    _exit(1);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return status;
}

}  // namespace

TEST_CASE("stores of a wild process reach no message of another, end no other, and its successor goes on") {
  const PoolFile file(2);
  const auto transport = make_local_transport(conformance_ports(), file, 1);
  std::vector<std::unique_ptr<Writer>> writers;
  std::vector<std::unique_ptr<Reader>> readers;
  for (const size_t port : kOurs) {
    writers.push_back(transport->make_writer(port));
    REQUIRE(writers.back()->loan() != nullptr);
    writers.back()->publish(1, 1, 1);
  }
  for (const size_t port : kTheirs) readers.push_back(transport->make_reader(port));
  std::vector<std::byte> ours = own_bytes(pools_in_memory());
  int ended = 0, went_through = 0;
  for (uint32_t seed = 0; seed < kStores; ++seed) {
    CAPTURE(seed);
    const int status = end_of([&] { wild_process(file, seed); });
    // Nothing but its own store ends it: it finds its way in what the ones before it have left.
    CHECK((WIFEXITED(status) ? WEXITSTATUS(status) == 0 : WTERMSIG(status) == SIGSEGV));
    WIFEXITED(status) ? ++went_through : ++ended;
    REQUIRE(own_bytes(pools_in_memory()) == ours);
    for (const auto& reader : readers)
      for (const Candidate& candidate : listed(*reader, kEver)) {
        Held held = reader->take(candidate.sequence);
        reader->release(held);
      }
    transport->reclaim(2);
    // The writer of an own port still finds a free chunk; the message before stays.
    REQUIRE(writers[0]->loan() != nullptr);
    writers[0]->discard();
    ours = own_bytes(pools_in_memory());
  }
  CHECK(ended > kStores / 10);
  CHECK(went_through > kStores / 10);
}
