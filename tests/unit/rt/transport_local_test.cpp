// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "rt/shm/local_transport.hpp"
#include "transport_conformance.hpp"

using namespace takt;
using namespace takt::test;

TEST_CASE("the local transport keeps what every transport promises") {
  const auto transport = make_local_transport(conformance_ports());
  transport_conformance(*transport);
}

TEST_CASE("the local transport keeps it in a process that joined, too") {
  const PoolFile file;
  const auto made = make_local_transport(conformance_ports(), file);
  const auto joined = join_local_transport(conformance_ports(), file);
  CHECK(joined->shared_memory_bytes() == made->shared_memory_bytes());
  transport_conformance(*joined);
}

TEST_CASE("messages of the local transport cross a process border without being copied") {
  const PoolFile file;
  const auto transport = make_local_transport(conformance_ports(), file);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    bool kept = false;
    try {  // mapped anew, at another address
      kept = publish_until_acknowledged(*join_local_transport(conformance_ports(), file));
    } catch (...) {  // else the child would go on with the tests
    }
    _exit(kept ? 0 : 1);
  }
  const auto acknowledgements = take_and_acknowledge(*transport);
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
}

TEST_CASE("a reader on one mapping sees what a writer on another publishes, and frees it") {
  const PoolFile file;
  const auto made = make_local_transport(conformance_ports(), file);
  const auto joined = join_local_transport(conformance_ports(), file);
  const auto writer = made->make_writer(basic);
  const auto reader = joined->make_reader(basic);
  publish(*writer, 7, 70, 71);
  const auto candidates = listed(*reader, kEver);
  REQUIRE(candidates.size() == 1);
  CHECK(candidates[0].stamp_ns == 70);
  CHECK(candidates[0].visible_at_ns == 71);
  Held held = reader->take(1);
  REQUIRE(held);
  CHECK(intact(held, 7));
  publish(*writer, 8, 80, 81);
  publish(*writer, 9, 90, 91);
  CHECK_MESSAGE(intact(held, 7), "a held message must not be written over");
  CHECK(writer->statistics().in_use == 3);
  reader->release(held);
  CHECK(writer->statistics().in_use == 2);
}

TEST_CASE("a writer does not repeat a message that went with the writer before it") {
  const auto transport = make_local_transport(conformance_ports());
  const auto reader = transport->make_reader(repeats);
  {
    const auto gone = transport->make_writer(repeats);
    publish(*gone, 5, 50, 51);
    CHECK(gone->repeat(60, 61));
  }
  const auto writer = transport->make_writer(repeats);
  CHECK_FALSE(writer->repeat(70, 71));
  publish(*writer, 8, 80, 81);
  CHECK(writer->repeat(90, 91));
  const auto candidates = listed(*reader, kEver);
  REQUIRE_FALSE(candidates.empty());
  CHECK(candidates[0].stamp_ns == 80);
}

TEST_CASE("pools that were made for other ports cannot be joined") {
  const PoolFile file;
  const auto made = make_local_transport(conformance_ports(), file);
  std::vector<PortPlan> fewer = conformance_ports();
  fewer.pop_back();
  CHECK_THROWS_AS(join_local_transport(fewer, file), std::logic_error);
}
