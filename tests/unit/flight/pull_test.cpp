// SPDX-License-Identifier: Apache-2.0
// Files of another machine: here a folder, and a shell in it for the connection.
#include "graph/flight/pull.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "graph/flight/remote_shell.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::flight;
namespace fs = std::filesystem;

namespace {

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Not compressible, with bytes that a shell could take for something else.
std::string bytes(size_t count, unsigned seed) {
  std::string text(count, '\0');
  for (size_t i = 0; i < count; ++i) {
    seed = seed * 1664525 + 1013904223;
    text[i] = static_cast<char>(seed >> 24);
  }
  return text;
}

/// The robot's home is `home`; what is pulled goes to `here`.
struct Robot {
  test::TemporaryFolder folder;
  fs::path home = folder.path / "home", here = folder.path / "pulled files";
  std::map<std::string, std::string> files;
  std::string out = "it's $HOME; `ls` \"out\"";

  Robot() { fs::create_directories(home / out / "flight/frozen"); }
  void freeze(const std::string& name, const std::string& content, const char* into = "frozen") {
    fs::create_directories(home / out / "flight" / into);
    std::ofstream(home / out / "flight" / into / name, std::ios::binary) << content;
    files[name] = content;
  }
  /// `behind`: what the answers go through.
  PullOptions options(const std::string& behind = "cat") const {
    PullOptions options;
    options.from = "user@robot:" + out;
    options.to = here;
    options.ssh = "sh -c " + shell_word("cd " + shell_word(home.string()) + "; sh | " + behind);
    return options;
  }
  PullOptions cut_off_after(int bytes) const {
    return options("{ dd bs=1 count=" + std::to_string(bytes) + " 2>/dev/null; kill -9 $$ 2>/dev/null; }");
  }
  void check_whole() const {
    for (const auto& [name, content] : files) CHECK_MESSAGE(content_of(here / name) == content, name);
    CHECK(std::distance(fs::directory_iterator(here), {}) == static_cast<ptrdiff_t>(files.size()));
  }
};

size_t count(const Pulled& pulled, PulledFile::State state) {
  return static_cast<size_t>(std::count_if(pulled.files.begin(), pulled.files.end(),
                                           [&](const PulledFile& file) { return file.state == state; }));
}

const std::string kClosed = "\x89MCAP0\r\n";

}  // namespace

TEST_CASE("A shell takes any text for one word") {
  auto shell = RemoteShell::here();
  REQUIRE(shell);
  for (const std::string text : {"", "a b", "it's", "$HOME `id` \"x\" \\ * ; #", "''", "-n", "\xc3\xa9"}) {
    shell->say("printf '%s\\n' " + shell_word(text));
    CHECK(shell->line() == text);
  }
  shell->say("exit 7");
  CHECK(!shell->line());
  CHECK(shell->end() == 7);
}

TEST_CASE("A limited transfer waits until it is no faster than it may be") {
  CHECK(pause_ns(1'000'000, 0, 0) == 0);
  CHECK(pause_ns(1'000'000, 0, 2e6) == 500'000'000);
  CHECK(pause_ns(1'000'000, 400'000'000, 2e6) == 100'000'000);
  CHECK(pause_ns(1'000'000, 600'000'000, 2e6) == 0);
}

TEST_CASE("Only HOST:FOLDER is an address, and no host is an option of ssh") {
  PullOptions options;
  options.list = true;
  for (const char* from : {"out", ":out", "-oProxyCommand=id:out", "a b:out", "a\n:out", ""}) {
    options.from = from;
    const Pulled pulled = pull(options);
    CHECK(pulled.fault == Pulled::input);
    CHECK(test::has(pulled.error, "is no HOST:FOLDER"));
  }
  options.ssh = "false";
  for (const auto& [from, host, folder] : {std::tuple("user@[::1]:out", "user@::1", "./out"),
                                           {"robot:~/out", "robot", "./out"},
                                           {"robot:/out", "robot", "/out"},
                                           {"robot:", "robot", "./"},
                                           {"robot:-x", "robot", "./-x"}}) {
    options.from = from;
    const Pulled pulled = pull(options);
    CHECK(pulled.host == host);
    CHECK(pulled.folder == folder);
    CHECK(pulled.fault == Pulled::system);
    CHECK(test::has(pulled.error, "cannot be reached (exit 1 of ssh"));
  }
}

TEST_CASE("What is frozen is fetched once, from whichever folder of the run is named") {
  Robot robot;
  robot.freeze("run-0001-mark.mcap", bytes(300'000, 1));
  robot.freeze("run 'two' $x-0002-mark.mcap", bytes(70'000, 2));
  robot.freeze("run-0003-miss.mcap", "");
  robot.freeze("half.mcap.part", "x");
  robot.files.erase("half.mcap.part");
  const Pulled first = pull(robot.options());
  CHECK(first.error == "");
  CHECK(count(first, PulledFile::fetched) == 3);
  CHECK(first.fetched_bytes == 370'000);
  CHECK(first.files[0].sha256.size() == 64);
  robot.check_whole();
  for (const char* below : {"", "/flight", "/flight/frozen", "/flight/frozen/"}) {
    PullOptions options = robot.options();
    options.from += below;
    const Pulled again = pull(options);
    CHECK(again.error == "");
    CHECK(count(again, PulledFile::here) == 3);
    CHECK(again.fetched_bytes == 0);
  }
  robot.freeze("run-0003-miss.mcap", "longer");
  const Pulled other = pull(robot.options());
  CHECK(other.fault == Pulled::broken);
  CHECK(test::has(other.error, "run-0003-miss.mcap: is another file than that of user@robot"));
  CHECK(content_of(robot.here / "run-0003-miss.mcap").empty());
}

TEST_CASE("A pull that is cut off anywhere goes on where it ended") {
  Robot robot;
  robot.freeze("run-0001-mark.mcap", bytes(50'000, 3));
  robot.freeze("run-0002-mark.mcap", bytes(30'000, 4));
  uint64_t fetched = 0;
  int pulls = 0;
  for (Pulled pulled;; ++pulls) {
    REQUIRE(pulls < 100);
    pulled = pull(robot.cut_off_after(500 + 700 * pulls));
    fetched += pulled.fetched_bytes;
    for (const auto& [name, content] : robot.files)
      if (fs::exists(robot.here / name)) CHECK(content_of(robot.here / name) == content);
    if (pulled.error.empty()) break;
    CHECK(pulled.fault == Pulled::system);
  }
  CHECK(pulls > 10);
  CHECK(fetched == 80'000);  // no byte twice
  robot.check_whole();
}

TEST_CASE("What an earlier pull left is taken if it is right, else fetched again") {
  for (const auto& [left, resumed_at, again] :
       {std::tuple(bytes(100'000, 5).substr(0, 40'000), uint64_t{40'000}, false),
        {bytes(100'000, 5), 100'000, false},
        {std::string(40'000, 'x'), 0, true},
        {std::string(100'000, 'x'), 0, true},
        {bytes(100'001, 5), 0, false}}) {
    Robot robot;
    robot.freeze("run-0001-mark.mcap", bytes(100'000, 5));
    fs::create_directories(robot.here);
    std::ofstream(robot.here / "run-0001-mark.mcap.part", std::ios::binary) << left;
    const Pulled pulled = pull(robot.options());
    CHECK(pulled.error == "");
    REQUIRE(pulled.files.size() == 1);
    CHECK(pulled.files[0].resumed_at == resumed_at);
    CHECK(pulled.files[0].again == again);
    robot.check_whole();
  }
}

TEST_CASE("What never becomes what was sent gets no name") {
  Robot robot;
  robot.freeze("run-0001-mark.mcap", "a" + bytes(1000, 6));
  const fs::path tail = robot.folder.write("tail", "#!/bin/sh\n/usr/bin/tail \"$@\" | LC_ALL=C tr a b\n");
  fs::permissions(tail, fs::perms::owner_all);
  PullOptions options = robot.options();
  options.ssh = "env PATH=" + robot.folder.path.string() + ":/usr/bin:/bin " + options.ssh;
  const Pulled pulled = pull(options);
  CHECK(pulled.fault == Pulled::broken);
  CHECK(test::has(pulled.error, "run-0001-mark.mcap: what came has another SHA-256 than user@robot has, twice"));
  CHECK(pulled.fetched_bytes == 2002);
  CHECK(!fs::exists(robot.here / "run-0001-mark.mcap"));
}

TEST_CASE("Files of the ring are fetched if they are closed") {
  Robot robot;
  robot.freeze("run-000001.mcap", bytes(5000, 7) + kClosed, "ring");
  robot.freeze("run-000002.mcap", bytes(5000, 8), "ring");
  robot.freeze("run-0001-mark.mcap", bytes(100, 9));
  PullOptions options = robot.options();
  CHECK(pull(options).files.size() == 1);
  options.ring = true;
  const Pulled pulled = pull(options);
  CHECK(pulled.error == "");
  CHECK(count(pulled, PulledFile::fetched) == 1);
  CHECK(count(pulled, PulledFile::here) == 1);
  CHECK(count(pulled, PulledFile::open) == 1);
  robot.files.erase("run-000002.mcap");
  robot.check_whole();
}

TEST_CASE("A file that is removed meanwhile is told, and costs the others nothing") {
  Robot robot;
  for (const char* name : {"a.mcap", "b.mcap", "c.mcap"}) robot.freeze(name, bytes(10'000, 10));
  PullOptions options = robot.options();
  options.told = [&](const PulledFile& file) {
    if (file.name == "a.mcap") fs::remove(robot.home / robot.out / "flight/frozen/b.mcap");
  };
  const Pulled pulled = pull(options);
  CHECK(pulled.error == "");
  CHECK(count(pulled, PulledFile::gone) == 1);
  CHECK(count(pulled, PulledFile::fetched) == 2);
  robot.files.erase("b.mcap");
  robot.check_whole();
}

TEST_CASE("A pull ends when it is asked to") {
  Robot robot;
  for (const char* name : {"a.mcap", "b.mcap"}) robot.freeze(name, bytes(10'000, 11));
  PullOptions options = robot.options();
  bool stopped = false;
  options.told = [&](const PulledFile&) { stopped = true; };
  options.stopped = [&] { return stopped; };
  const Pulled pulled = pull(options);
  CHECK(pulled.fault == Pulled::broken);
  CHECK(test::has(pulled.error, "interrupted"));
  CHECK(count(pulled, PulledFile::fetched) == 1);
}

TEST_CASE("What is missing is named") {
  Robot robot;
  const auto error = [&](PullOptions options, const char* ssh = nullptr) {
    options.list = true;
    if (ssh != nullptr) options.ssh = ssh;
    return pull(options).error;
  };
  PullOptions options = robot.options();
  CHECK(test::has(error(options, "/nowhere/ssh 2>/dev/null"),
                  "`/nowhere/ssh 2>/dev/null` cannot be started; install it"));
  CHECK(test::has(error(options, "sh -c 'echo Welcome; exit 255'"), "user@robot cannot be reached (exit 255 of ssh"));
  CHECK(test::has(error(options, "sh -c 'PATH=/nowhere; exec /bin/sh'"),
                  "user@robot lacks stat head tail tr sha256sum; install coreutils there"));
  CHECK(error(options, ("sh -c " + shell_word("echo Welcome; printf hello; " + options.ssh)).c_str()) == "");
  options.from += "/none";
  CHECK(test::has(error(options), "user@robot has no folder"));
  options.from = "user@robot:.";
  CHECK(test::has(error(options), "has neither `flight` nor `frozen` or `ring` in it"));
}

TEST_CASE("A name that this machine could not take for one is passed over") {
  Robot robot;
  robot.freeze("a.mcap", "a");
  for (const char* name : {"line\nbreak.mcap", "\x1b[2J.mcap"}) {
    robot.freeze(name, "x");
    robot.files.erase(name);
  }
  CHECK(pull(robot.options()).files.size() == 1);
  robot.check_whole();
}
