// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/iceoryx_preflight.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "rt/file/lock_holder.hpp"
#include "rt/msg/image.hpp"
#include "rt/shm/iceoryx_layout.hpp"
#include "rt/shm/transport_error.hpp"
#include "rt/thread_state.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using test::has;

namespace {

struct Directory : test::TemporaryFolder {
  Directory() {
    std::filesystem::create_directories(path / "run");
    std::filesystem::create_directories(path / "shm");
  }
  IceoryxPlaces places() const {
    IceoryxPlaces places = IceoryxPlaces::of_this_machine();
    places.run = path / "run";
    places.shm = path / "shm";
    return places;
  }
};

std::string refusal(const IceoryxPlaces& places, uint64_t bytes = 0) {
  try {
    iceoryx_preflight(places, bytes);
  } catch (const TransportError& error) {
    return error.what();
  }
  return {};
}

PortPlan port(uint32_t width, uint32_t history, uint32_t held, uint32_t readers) {
  return {"node", "port", &MessageType::of<Image>(), {.width = width, .height = 1, .channels = 1}, history,
          held,   readers};
}

}  // namespace

TEST_CASE("an empty machine passes") {
  const Directory directory;
  CHECK(refusal(directory.places()).empty());
}

TEST_CASE("what the clients of a run left that was killed whole is removed, what the living have is not") {
  const Directory directory;
  const pid_t dead = fork();
  if (dead == 0) _exit(0);
  REQUIRE(waitpid(dead, nullptr, 0) == dead);
  const auto file = [&](const std::string& name) { return directory.path / "run" / name; };
  const std::string of_dead = "takt-" + std::to_string(dead) + "-0",
                    of_living = "takt-" + std::to_string(getpid()) + "-0";
  for (const std::string& name :
       {of_dead, of_dead + ".lock", of_living, std::string("takt-12-notes"), std::string("other")})
    std::ofstream(file(name)) << "x";
  CHECK(refusal(directory.places()).empty());
  CHECK_FALSE(std::filesystem::exists(file(of_dead)));
  CHECK_FALSE(std::filesystem::exists(file(of_dead + ".lock")));
  CHECK(std::filesystem::exists(file(of_living)));
  CHECK(std::filesystem::exists(file("takt-12-notes")));
  CHECK(std::filesystem::exists(file("other")));
}

TEST_CASE("one that has ended is dead, also before its parent has asked for its end") {
  const Directory directory;
  const pid_t dead = fork();
  if (dead == 0) _exit(0);
  siginfo_t ended;
  REQUIRE(waitid(P_PID, static_cast<id_t>(dead), &ended, WEXITED | WNOWAIT) == 0);
  const auto file = directory.path / "run" / ("takt-" + std::to_string(dead) + "-0");
  std::ofstream(file) << "x";
  CHECK(refusal(directory.places()).empty());
  CHECK_FALSE(std::filesystem::exists(file));
  REQUIRE(waitpid(dead, nullptr, 0) == dead);
}

TEST_CASE("the holder of a lock is found") {
  const Directory directory;
  const auto lock = directory.path / "run/iox-unique-roudi.lock";
  const int file = open(lock.c_str(), O_CREAT | O_RDWR, 0600);
  CHECK_FALSE(lock_holder(lock, "/proc/locks"));
  CHECK(refusal(directory.places()).empty());  // a lock nobody holds, and ours
  REQUIRE(flock(file, LOCK_EX | LOCK_NB) == 0);
  CHECK(lock_holder(lock, "/proc/locks") == getpid());
  const std::string message = refusal(directory.places());
  CHECK(has(message, "another iceoryx daemon is running"));
  CHECK(has(message, "kill " + std::to_string(getpid())));
  close(file);
}

TEST_CASE("a daemon whose process is just ending, or gone when it is asked for, is awaited; one that lives is not") {
  const Directory directory;
  IceoryxPlaces places = directory.places();
  places.locks = directory.path / "locks";
  const auto path = directory.path / "run/iox-unique-roudi.lock";
  const int lock = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  REQUIRE(flock(lock, LOCK_EX | LOCK_NB) == 0);
  struct stat status {};
  REQUIRE(fstat(lock, &status) == 0);
  const auto held_by = [&](pid_t pid) {
    std::array<char, 96> line{};
    std::snprintf(line.data(), line.size(), "1: FLOCK  ADVISORY  WRITE %d %02x:%02x:%lu 0 EOF\n", pid,
                  major(status.st_dev), minor(status.st_dev), static_cast<unsigned long>(status.st_ino));
    return std::string(line.data());
  };
  std::ofstream(places.locks) << held_by(getpid());
  CHECK(has(refusal(places), "another iceoryx daemon is running: process " + std::to_string(getpid())));

  const pid_t ending = fork();  // nobody asks for its end yet
  if (ending == 0) _exit(0);
  while (!thread_state(ending)->ended()) std::this_thread::yield();
  REQUIRE(std::filesystem::remove(places.locks));
  REQUIRE(mkfifo(places.locks.c_str(), 0600) == 0);
  for (const std::string& line : {held_by(ending), std::string()}) {
    REQUIRE(flock(lock, LOCK_EX | LOCK_NB) == 0);
    std::thread daemon([&] {
      const int table = open(places.locks.c_str(), O_WRONLY | O_CLOEXEC);  // until somebody looks who holds the lock
      CHECK(write(table, line.data(), line.size()) == static_cast<ssize_t>(line.size()));
      flock(lock, LOCK_UN);
      close(table);
    });
    CHECK(refusal(places).empty());
    const int unread = open(places.locks.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);  // if nobody looked
    daemon.join();
    close(unread);
  }
  CHECK(waitpid(ending, nullptr, 0) == ending);
  close(lock);
}

TEST_CASE("a lock table with waiting processes is read") {
  const Directory directory;
  const auto lock = directory.path / "x";
  std::ofstream(lock) << "x";
  std::ofstream(directory.path / "locks")
      << "1: POSIX  ADVISORY  WRITE 77 00:01:2 0 EOF\n1: -> POSIX  ADVISORY  WRITE 78 00:01:2 0 EOF\n"
         "2: FLOCK  ADVISORY  WRITE 79 00:01:3 0 EOF\n";
  CHECK_FALSE(lock_holder(lock, directory.path / "locks"));
  CHECK_FALSE(lock_holder(directory.path / "absent", directory.path / "locks"));
}

TEST_CASE("leftovers of another user are named with the fix") {
  if (geteuid() != 0) {
    MESSAGE("NOT RUN: giving a file to another user needs root");
    return;
  }
  const Directory directory;
  for (const char* name : {"run/iox-unique-roudi.lock", "run/roudi", "shm/iceoryx_mgmt"}) {
    const auto file = directory.path / name;
    std::ofstream(file) << "";
    REQUIRE(chown(file.c_str(), 12345, 12345) == 0);
    IceoryxPlaces places = directory.places();
    places.user = 54321;
    const std::string message = refusal(places);
    CAPTURE(message);
    CHECK(has(message, "belongs to user 12345, this process runs as user 54321"));
    CHECK(has(message, "sudo rm " + file.string()));
    std::filesystem::remove(file);
  }
}

TEST_CASE("too little shared memory is a refusal with figures") {
  const Directory directory;
  const std::string message = refusal(directory.places(), uint64_t{1} << 60);
  CHECK(has(message, "free, the message pools of this graph need 1152921504607 MB"));
  CHECK(has(message, "remount,size="));
}

TEST_CASE("each output has a pool of its own, large enough, in ascending order") {
  const std::vector<PortPlan> ports{port(900, 4, 2, 2), port(100, 1, 0, 0), port(100, 2, 1, 1), port(921600, 3, 5, 3)};
  const IceoryxLayout layout = IceoryxLayout::of(ports);
  REQUIRE(layout.pools.size() == 5);
  for (size_t i = 1; i < layout.pools.size(); ++i)
    CHECK(layout.pools[i].loan_bytes >= layout.pools[i - 1].loan_bytes + 64);
  for (size_t i = 0; i < ports.size(); ++i) {
    const IceoryxPool& pool = layout.pools[layout.pool_of_port[i]];
    CHECK(pool.loan_bytes >= ports[i].chunk_bytes());
    CHECK(pool.chunks == iceoryx_chunks(ports[i]));
    CHECK(pool.payload_bytes % 8 == 0);
    for (size_t j = 0; j < i; ++j) CHECK(layout.pool_of_port[i] != layout.pool_of_port[j]);
  }
  CHECK(iceoryx_chunks(ports[0]) == 4 + 2 + 2 + 2 * 4);
  CHECK(layout.bytes() > 921600 * iceoryx_chunks(ports[3]));
}

TEST_CASE("more outputs than pools: neighbours share, nobody loses chunks") {
  std::vector<PortPlan> ports;
  for (uint32_t i = 0; i < 100; ++i) ports.push_back(port(64 + (i * i * 37) % 5000, 1 + i % 4, i % 3, i % 3));
  const IceoryxLayout layout = IceoryxLayout::of(ports);
  CHECK(layout.pools.size() == 32);
  uint64_t wanted = 0, given = 0;
  for (size_t i = 0; i < ports.size(); ++i) {
    CHECK(layout.pools[layout.pool_of_port[i]].loan_bytes >= ports[i].chunk_bytes());
    wanted += iceoryx_chunks(ports[i]);
  }
  for (size_t i = 1; i < layout.pools.size(); ++i) given += layout.pools[i].chunks;
  CHECK(given == wanted);
}

TEST_CASE("what iceoryx cannot carry is refused with the output's name") {
  const auto refused = [](std::vector<PortPlan> ports) -> std::string {
    try {
      IceoryxLayout::of(ports);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  CHECK(has(refused({port(10, 0, 0, 0)}), "node.port keeps no message"));
  CHECK(has(refused({port(10, 200, 56, 1)}), "exceed the 255"));
  CHECK(has(refused({port(4'000'000'000, 1, 0, 0)}), "larger than iceoryx can carry"));
  CHECK(has(refused(std::vector<PortPlan>(254, port(10, 1, 0, 0))), "254 outputs"));
  CHECK(has(refused(std::vector<PortPlan>(200, port(10, 1, 0, 3))), "600 edges"));
  CHECK(IceoryxLayout::of({}).pools.size() == 1);
}
