// SPDX-License-Identifier: Apache-2.0
#include "graph/command/new_command.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::command;

namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Names of all that lies in a folder.
std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

/// Works in that folder as long as it lives.
class WorkingFolder {
 public:
  explicit WorkingFolder(const fs::path& folder) : before_(fs::current_path()) { fs::current_path(folder); }
  ~WorkingFolder() { fs::current_path(before_); }

 private:
  fs::path before_;
};

struct Templates {
  test::TemporaryFolder folder;
  Templates() {
    std::ofstream(folder.path / "@NAME@.yaml.in") << "name: @NAME@, @NAME@_test\n";
    std::ofstream(folder.path / "main.cpp.in") << "int main() {}\n";
  }
};

}  // namespace

TEST_CASE("a project's name: letters, digits, single underscores; no word that has another meaning") {
  for (const char* good : {"r", "robot", "my_robot", "r2d2", "name", "classes", "a_1"}) {
    INFO(good);
    CHECK(wrong_with_name(good) == "");
  }
  for (const char* bad : {"", "2robot", "_robot", "robot_", "my__robot", "Robot", "my-robot", "my robot", "a/b", ".",
                          "..", "@NAME@", "r\xc3\xb6"}) {
    INFO(bad);
    CHECK(wrong_with_name(bad).find("for instance blue_robot") != std::string::npos);
  }
  CHECK(wrong_with_name(std::string(40, 'r')) == "");
  CHECK(wrong_with_name(std::string(41, 'r')) != "");
  for (const char* taken : {"class", "xor", "takt", "schedule", "gauge", "test", "install"}) {
    INFO(taken);
    CHECK(wrong_with_name(taken).find(std::string(taken) + "_robot") != std::string::npos);
  }
}

TEST_CASE("what is filled in is not looked at again") {
  CHECK(filled("@NAME@: @NAME@_test, NAME, @", "robot") == "robot: robot_test, NAME, @");
  CHECK(filled("@NAME@", "my_@NAME@_NAME") == "my_@NAME@_NAME");
  CHECK(filled("", "robot") == "");
}

TEST_CASE("a project is all files of the templates, with the name in their names and contents") {
  const Templates templates;
  const test::TemporaryFolder home;
  const WorkingFolder work(home.path);
  REQUIRE(make_project(templates.folder.path, "my_robot") == 0);
  CHECK(names_in(home.path) == std::vector<std::string>{"my_robot"});
  CHECK(names_in("my_robot") == std::vector<std::string>{"main.cpp", "my_robot.yaml"});
  CHECK(content("my_robot/my_robot.yaml") == "name: my_robot, my_robot_test\n");
}

TEST_CASE("what cannot be made leaves nothing behind") {
  const Templates templates;
  const test::TemporaryFolder home;
  const WorkingFolder work(home.path);
  CHECK(make_project(templates.folder.path, "class") == 2);
  CHECK(make_project(home.path / "nowhere", "robot") == 3);
  fs::create_directory(templates.folder.path / "unreadable.in");  // a folder is no file to read
  CHECK(make_project(templates.folder.path, "robot") == 3);
  CHECK(names_in(home.path).empty());
  fs::remove(templates.folder.path / "unreadable.in");
  {
    const WorkingFolder unwritable("/proc");
    CHECK(make_project(templates.folder.path, "robot") == 3);
  }

  fs::create_directory("robot");
  fs::create_symlink("nowhere", "link");
  CHECK(make_project(templates.folder.path, "robot") == 2);
  CHECK(make_project(templates.folder.path, "link") == 2);
  CHECK(names_in(home.path) == std::vector<std::string>{"link", "robot"});
  CHECK(names_in("robot").empty());
}
