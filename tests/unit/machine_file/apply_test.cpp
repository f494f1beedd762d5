// SPDX-License-Identifier: Apache-2.0
#include "graph/machine_file/apply.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

using namespace takt::graph;
namespace fs = std::filesystem;

namespace {

class Root {
 public:
  Root() {
    std::string name = (fs::temp_directory_path() / "takt-root-XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    folder = name;
  }
  ~Root() { fs::remove_all(folder); }
  Root(const Root&) = delete;

  void write(const std::string& path, const std::string& text) const {
    fs::create_directories((folder / path).parent_path());
    std::ofstream(folder / path) << text;
  }
  std::string read(const std::string& path) const {
    std::ifstream in(folder / path);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  bool has(const std::string& path) const { return fs::exists(fs::symlink_status(folder / path)); }

  fs::path folder;
};

const std::vector<SystemFile> kFiles{
    {"/etc/a/new", "of takt\n"}, {"/etc/old", "of takt\n"}, {"/etc/zone", "", "/usr/b"}};

}  // namespace

TEST_CASE("what was there comes back, what was not goes") {
  const Root root;
  root.write("etc/old", "of Debian\n");
  fs::create_symlink("/usr/a", root.folder / "etc/zone");
  const auto applied = apply_files(kFiles, root.folder);
  REQUIRE(applied);
  CHECK(applied->written == std::vector<std::string>{"/etc/a/new", "/etc/old", "/etc/zone"});
  CHECK(root.read("etc/old") == "of takt\n");
  CHECK(fs::read_symlink(root.folder / "etc/zone") == "/usr/b");
  const auto undone = undo_files(root.folder);
  REQUIRE(undone);
  CHECK(undone->removed == std::vector<std::string>{"/etc/a/new"});
  CHECK(undone->restored == std::vector<std::string>{"/etc/old", "/etc/zone"});
  CHECK(!root.has("etc/a/new"));
  CHECK(root.read("etc/old") == "of Debian\n");
  CHECK(fs::read_symlink(root.folder / "etc/zone") == "/usr/a");
  const auto again = undo_files(root.folder);
  REQUIRE(again);
  CHECK(again->removed.empty());
}

TEST_CASE("another machine file replaces the first; what was there before both is not forgotten") {
  const Root root;
  root.write("etc/old", "of Debian\n");
  REQUIRE(apply_files(kFiles, root.folder));
  const auto other = apply_files({{"/etc/old", "of another\n"}}, root.folder);
  REQUIRE(other);
  CHECK(!root.has("etc/a/new"));
  CHECK(root.read("etc/old") == "of another\n");
  REQUIRE(undo_files(root.folder));
  CHECK(root.read("etc/old") == "of Debian\n");
}

TEST_CASE("what somebody changed since is left alone, and named") {
  const Root root;
  REQUIRE(apply_files(kFiles, root.folder));
  root.write("etc/old", "by hand\n");
  const auto undone = undo_files(root.folder);
  REQUIRE(undone);
  CHECK(undone->kept == std::vector<std::string>{"/etc/old"});
  CHECK(root.read("etc/old") == "by hand\n");
}

TEST_CASE("a call that was cut off after some files can be undone") {
  const Root root;
  REQUIRE(apply_files(kFiles, root.folder));
  fs::remove(root.folder / "etc/old");
  fs::remove(root.folder / "etc/zone");
  const auto undone = undo_files(root.folder);
  REQUIRE(undone);
  CHECK(undone->kept.empty());
  CHECK(!root.has("etc/a/new"));
}

TEST_CASE("what cannot be written is named, and what was written can be undone") {
  const Root root;
  root.write("etc/a", "a file where a folder should be");
  const auto applied = apply_files(kFiles, root.folder);
  REQUIRE(!applied);
  CHECK(applied.error().find("etc/a") != std::string::npos);
  const auto undone = undo_files(root.folder);
  REQUIRE(undone);
  CHECK(root.read("etc/a") == "a file where a folder should be");
}

TEST_CASE("a damaged list is told, not obeyed") {
  const Root root;
  REQUIRE(apply_files(kFiles, root.folder));
  root.write("var/lib/takt/machine/applied.json", "[{\"path\": \"/etc/old\"}]");
  const auto undone = undo_files(root.folder);
  REQUIRE(!undone);
  CHECK(undone.error().find("damaged") != std::string::npos);
  CHECK(root.has("etc/old"));
}
