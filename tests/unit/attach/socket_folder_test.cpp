// SPDX-License-Identifier: Apache-2.0
// The folder of the sockets: whose it may be, and what happens if somebody else was there first.
#include "graph/attach/socket_folder.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/temporary_folder.hpp"

namespace {

using takt::attach::SocketFolder;
using takt::attach::Surroundings;
namespace fs = std::filesystem;

constexpr uid_t kStranger = 65534;

/// /run, /tmp and a home of its own; an ordinary user's, even if root runs the test.
struct Machine : takt::test::TemporaryFolder {
  Surroundings where;
  Machine() {
    where.user = geteuid();
    where.home = path / "home";
    where.run = path / "run";
    where.tmp = path / "tmp";
    for (const fs::path& folder : {fs::path(where.home), where.run, where.tmp}) fs::create_directory(folder);
  }
  fs::path in_tmp() const { return where.tmp / ("takt." + std::to_string(where.user)); }
  /// Where this user's folder is if nothing is in the way, and root is nobody special.
  fs::path first() const { return where.user == 0 ? where.run / "takt.0" : in_tmp(); }
};

mode_t mode_of(const fs::path& file) {
  struct stat facts {};
  REQUIRE(lstat(file.c_str(), &facts) == 0);
  return facts.st_mode & 07777;
}

}  // namespace

TEST_CASE("the folder is made for its user alone, and found again") {
  Machine machine;
  std::string why;
  const auto made = SocketFolder::own(machine.where, why);
  REQUIRE(made);
  CHECK(made->path() == machine.first());
  CHECK(why.empty());
  CHECK(mode_of(made->path()) == 0700);
  CHECK_FALSE(made->for_group());
  CHECK(SocketFolder::own(machine.where, why)->path() == machine.first());
  machine.where.xdg_runtime = machine.path;
  CHECK(SocketFolder::own(machine.where, why)->path() == machine.path / "takt");
}

TEST_CASE("a folder that is a link, a file, or open to others is passed over, and told with the way out") {
  Machine machine;
  const fs::path taken = machine.first();
  std::string reason;
  SUBCASE("link") {
    fs::create_directory(machine.path / "elsewhere");
    chmod((machine.path / "elsewhere").c_str(), 0700);
    fs::create_directory_symlink(machine.path / "elsewhere", taken);
    reason = "is a link of user";
  }
  SUBCASE("file") {
    machine.write(fs::relative(taken, machine.path), "");
    reason = "is no folder, but a file of user";
  }
  SUBCASE("open to others") {
    fs::create_directory(taken);
    chmod(taken.c_str(), 0755);
    reason = "is open to other users (mode 0755); close it with: chmod go= " + taken.string();
  }
  if (reason.empty()) return;
  std::string why;
  const auto folder = SocketFolder::own(machine.where, why);
  REQUIRE(folder);
  CHECK(folder->path() != taken);
  CHECK(mode_of(folder->path()) == 0700);
  CHECK_MESSAGE(why.find(taken.string() + ": " + reason) == 0, why);
}

TEST_CASE("where nothing is left, each folder is told") {
  Machine machine;
  machine.where.home = "";
  for (const fs::path& taken : {machine.first(), machine.in_tmp()}) {
    fs::create_directory(taken);
    chmod(taken.c_str(), 0777);
  }
  std::string why;
  CHECK_FALSE(SocketFolder::own(machine.where, why));
  CHECK(why.find(machine.first().string()) != std::string::npos);
  CHECK(why.find(machine.in_tmp().string()) != std::string::npos);
}

TEST_CASE("a folder that another user has made is passed over, and its owner named") {
  Machine machine;
  fs::create_directory(machine.first());
  chmod(machine.first().c_str(), 0700);
  if (chown(machine.first().c_str(), kStranger, kStranger) != 0) {
    MESSAGE("NOT RUN: only root can give a folder to another user");
    return;
  }
  std::string why;
  const auto folder = SocketFolder::own(machine.where, why);
  REQUIRE(folder);
  CHECK(folder->path() == machine.in_tmp());
  CHECK_MESSAGE(why.find("belongs to user nobody (uid 65534); its owner or root removes it") != std::string::npos, why);
}

TEST_CASE("what happens to the name of a folder afterwards changes nothing") {
  Machine machine;
  std::string why;
  const auto folder = SocketFolder::own(machine.where, why);
  REQUIRE(folder);
  fs::rename(machine.first(), machine.path / "moved");
  fs::create_directory(machine.first());
  REQUIRE(mknodat(AT_FDCWD, folder->address(17).sun_path, S_IFREG | 0600, 0) == 0);
  CHECK(folder->pids() == std::vector<int>{17});
  CHECK(fs::exists(machine.path / "moved" / "17.sock"));
  CHECK(fs::is_empty(machine.first()));
  folder->remove_socket(17);
  CHECK(folder->pids().empty());
}

TEST_CASE("a service has the folder that its service manager made, with its group; others find it there") {
  Machine machine;
  machine.where.user = geteuid() == 0 ? kStranger : geteuid();
  const fs::path service = machine.where.run / "takt";
  fs::create_directory(service);
  chmod(service.c_str(), 0750);
  if (geteuid() == 0) REQUIRE(chown(service.c_str(), kStranger, kStranger) == 0);
  std::string why;
  const auto own = SocketFolder::own(machine.where, why);
  REQUIRE(own);
  CHECK(own->path() == service);
  CHECK(own->for_group());
  Surroundings operators = machine.where;
  operators.user = 12345;
  CHECK(SocketFolder::of_service(operators)->path() == service);
  chmod(service.c_str(), 0770);
  CHECK_FALSE(SocketFolder::of_service(operators));
}

TEST_CASE("the sockets of replays lie beside those of runs and are never taken for one") {
  Machine machine;
  std::string why;
  const auto folder = SocketFolder::own(machine.where, why);
  REQUIRE(folder);
  for (const char* name : {"12.sock", "7.sock", "replay-9.sock", "replay-.sock", "replay-8", "x3.sock", "5.sock.old"})
    std::ofstream(folder->path() / name) << "";
  CHECK(folder->pids() == std::vector<int>{7, 12});
  CHECK(folder->pids(SocketFolder::Of::replay) == std::vector<int>{9});
  CHECK(std::string(folder->address(9).sun_path).ends_with("/9.sock"));
  CHECK(std::string(folder->address(9, SocketFolder::Of::replay).sun_path).ends_with("/replay-9.sock"));
  folder->remove_socket(9);
  CHECK(folder->pids(SocketFolder::Of::replay).size() == 1);
  folder->remove_socket(9, SocketFolder::Of::replay);
  CHECK(folder->pids(SocketFolder::Of::replay).empty());
}
