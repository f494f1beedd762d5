// SPDX-License-Identifier: Apache-2.0
// `takt new NAME`: a project to begin with.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace takt::command {

struct NewOptions {
  std::string name;
};

/// `text` with `@NAME@` and `@Name@` replaced by the name as it is (blue_robot) and as a class is called (BlueRobot).
/// What is put in is not looked at again: a name may contain anything.
std::string filled(const std::string& text, const std::string& name);

/// Adds the command. It makes the folder NAME in the working folder, with the files of graph/new/. 0 done; 2 a bad
/// name, or there is such a file already; 3 it cannot be written. Either all of it is there or nothing.
void add_new(CLI::App& app, NewOptions& options, int& exit_code);

}  // namespace takt::command
