// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/iceoryx_transport.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "private_namespace.hpp"
#include "rt/shm/transport_error.hpp"
#include "transport_conformance.hpp"

using namespace takt;
using namespace takt::test;

TEST_CASE("the iceoryx transport keeps what every transport promises, and leaves nothing behind") {
  if (!private_tmp_and_shm()) return;
  {
    const auto transport = make_iceoryx_transport(conformance_ports());
    CHECK(std::string(transport->name()) == "iceoryx");
    CHECK_FALSE(files_left().empty());
    transport_conformance(*transport);
  }
  for (const std::string& file : files_left()) FAIL_CHECK("left behind: ", file);
}

TEST_CASE("a second iceoryx transport in the process is refused, one after the other is not") {
  if (!private_tmp_and_shm()) return;
  const auto ports = conformance_ports();
  {
    const auto transport = make_iceoryx_transport(ports);
    CHECK_THROWS_AS(make_iceoryx_transport(ports), TransportError);
    const auto writer = transport->make_writer(basic);
    const auto reader = transport->make_reader(basic);
    CHECK(transport->chunks_in_use() == 0);
    publish(*writer, 3, 0, 0);
    CHECK(transport->chunks_in_use() > 0);
    CHECK(sequences(*reader, kEver) == Sequences{1});
  }
  const auto transport = make_iceoryx_transport(ports);
  const auto reader = transport->make_reader(basic);
  CHECK_MESSAGE(listed(*reader, kEver).empty(), "nothing of the transport before may be seen");
}

// Started by the next test in a process of its own: publishes 50 messages, then waits until they are acknowledged.
TEST_CASE("peer: publishes from another process" * doctest::skip()) {
  const char* domain = std::getenv("TAKT_TEST_DOMAIN");
  if (domain == nullptr) return;
  CHECK(publish_until_acknowledged(*join_iceoryx_transport(conformance_ports(), domain)));
}

TEST_CASE("messages cross a process border without being copied") {
  if (!private_tmp_and_shm()) return;
  {
    const auto transport = make_iceoryx_transport(conformance_ports());
    setenv("TAKT_TEST_DOMAIN", iceoryx_domain(getpid()).c_str(), 1);
    const char* arguments[] = {"peer", "--test-case=peer: publishes from another process", "--no-skip", "--minimal",
                               nullptr};
    pid_t child = 0;
    REQUIRE(posix_spawn(&child, "/proc/self/exe", nullptr, nullptr, const_cast<char**>(arguments), environ) == 0);
    const auto acknowledgements = take_and_acknowledge(*transport);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    unsetenv("TAKT_TEST_DOMAIN");
  }
  for (const std::string& file : files_left()) FAIL_CHECK("left behind: ", file);
}

TEST_CASE("a running daemon is named, with the way to stop it") {
  if (!private_tmp_and_shm()) return;
  const char* lock = "/tmp/iox-unique-roudi.lock";
  const int file = open(lock, O_CREAT | O_RDWR, 0600);
  REQUIRE(flock(file, LOCK_EX | LOCK_NB) == 0);
  std::string message;
  try {
    make_iceoryx_transport(conformance_ports());
  } catch (const TransportError& error) {
    message = error.what();
  }
  close(file);
  unlink(lock);
  CHECK(message.find("another iceoryx daemon is running: process " + std::to_string(getpid())) != std::string::npos);
  CHECK(message.find("kill " + std::to_string(getpid())) != std::string::npos);
}

TEST_CASE("leftovers of this user do not keep the transport from starting") {
  if (!private_tmp_and_shm()) return;
  for (const char* name : {"/tmp/iox-unique-roudi.lock", "/tmp/roudi", "/dev/shm/iceoryx_mgmt"})
    close(open(name, O_CREAT | O_RDWR, 0600));
  { const auto transport = make_iceoryx_transport(conformance_ports()); }
  for (const std::string& file : files_left()) FAIL_CHECK("left behind: ", file);
}
