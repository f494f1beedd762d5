// SPDX-License-Identifier: Apache-2.0
#include "graph/run/web_beside.hpp"

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::command;

namespace {

/// A program in place of takt-web: what it does, in words of the shell.
std::vector<std::string> program(const test::TemporaryFolder& folder, const std::string& does) {
  const std::filesystem::path file = folder.write("server", "#!/bin/sh\n" + does + "\n");
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  return {file.string(), "--with-run", "7"};
}

bool appears(const std::filesystem::path& file) {
  for (int i = 0; i < 300 && !std::filesystem::exists(file); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return std::filesystem::exists(file);
}

}  // namespace

TEST_CASE("the program begins when it is told to, is no child of this process, and its address is waited for") {
  const test::TemporaryFolder folder;
  const std::filesystem::path began = folder.path / "began";
  WebBeside web(program(folder, "echo $1 $2 >" + began.string() + "; echo http://page; echo Foxglove: ws://page"));
  CHECK(!std::filesystem::exists(began));
  CHECK(web.begin());
  CHECK(appears(began));
  CHECK(waitpid(-1, nullptr, WNOHANG) == -1);
}

TEST_CASE("a program that ends before it says its address did not start") {
  const test::TemporaryFolder folder;
  WebBeside web(program(folder, "exit 3"));
  const auto begun = web.begin();
  REQUIRE(!begun);
  CHECK(begun.error() == "--web: takt-web did not start; without --web the run needs none");
}

TEST_CASE("a run that is refused leaves nothing behind") {
  const test::TemporaryFolder folder;
  const std::filesystem::path began = folder.path / "began";
  { const WebBeside web(program(folder, "echo >" + began.string())); }
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  CHECK(!std::filesystem::exists(began));
}

TEST_CASE("the options of a graph become those of takt web") {
  graph::WebSpec web;
  web.port = 80;
  web.token_file = "/robot/token";
  web.hosts = {"ace", "ace.local"};
  CHECK(web_arguments("takt-web", web) == std::vector<std::string>{"takt-web", "--with-run", std::to_string(getpid()),
                                                                   "--port", "80", "--token-file", "/robot/token",
                                                                   "--host", "ace", "--host", "ace.local"});
  CHECK(web_arguments("takt-web", {}).size() == 3);
}
