// SPDX-License-Identifier: Apache-2.0
// Assets that Takt ships with: where they are, and what a record calls them.
#include "graph/language/share.hpp"

#include <doctest/doctest.h>

#include <cstdlib>

#include "rt/node.hpp"
#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::graph;

namespace {

/// TAKT_HOME for as long as it lives.
struct Home {
  std::string before;
  bool had = false;
  explicit Home(const std::filesystem::path& folder) {
    if (const char* value = std::getenv("TAKT_HOME")) before = value, had = true;
    if (folder.empty()) unsetenv("TAKT_HOME");
    else setenv("TAKT_HOME", folder.c_str(), 1);
  }
  ~Home() {
    if (had) setenv("TAKT_HOME", before.c_str(), 1);
    else unsetenv("TAKT_HOME");
  }
  Home(const Home&) = delete;
  Home& operator=(const Home&) = delete;
};

struct AssetReader final : Node {
  void setup(Setup&) override {}
  void run(Job&) override {}
  Param<std::string> signs{this, "signs", "signs", kPath, ""}, own{this, "own", "own/data.txt", kPath, ""},
      none{this, "none", "", kPath, ""}, word{this, "word", "signs", "", ""};
};

}  // namespace

TEST_CASE("share folder: of a build it is the source tree, found from the library") {
  const Home home("");
  CHECK(std::filesystem::equivalent(share_folder() / "graph", test::graph_folder()));
}

TEST_CASE("a default of the share folder is found there, another one stays as it is") {
  test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.path / "graph/signs");
  const Home home(folder.path);
  const AssetReader node;
  CHECK(default_asset(node.signs) == folder.path / "graph/signs");
  CHECK(default_asset(node.own) == "own/data.txt");
  CHECK(default_asset(node.none).empty());
}

TEST_CASE("a record calls an asset of the share folder by its name there, wherever it is") {
  test::TemporaryFolder here, there;
  AssetReader node;
  for (const auto* folder : {&here, &there}) {
    std::filesystem::create_directories(folder->path / "graph/signs");
    const Home home(folder->path);
    REQUIRE(node.signs.set(default_asset(node.signs)));
    CHECK(recorded_text(node.signs) == "signs");
    REQUIRE(node.signs.set(std::string("signs")));
    REQUIRE(node.own.set((folder->path / "mine").string()));
    CHECK(recorded_text(node.own) == folder->path / "mine");
  }
  CHECK(recorded_text(node.word) == "signs");
}
