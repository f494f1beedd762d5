// SPDX-License-Identifier: Apache-2.0
// `takt new NAME`: a project to begin with.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

namespace takt::command {

struct NewOptions {
  std::string name;
};

/// Why this cannot be the name of a project, and what can; empty: it can.
std::string wrong_with_name(std::string_view name);

/// `text` with `name` for each `@NAME@`. What is put in is not looked at again: a name may contain anything.
std::string filled(std::string_view text, std::string_view name);

/// Makes the folder `name` in the working folder, from the files of `templates`, whose names end with .in. The exit
/// code: 0 done; 2 a bad name, or there is something of that name; 3 it cannot be written. All of it is there or
/// nothing.
int make_project(const std::filesystem::path& templates, const std::string& name);

/// Adds the command.
void add_new(CLI::App& app, NewOptions& options, int& exit_code);

}  // namespace takt::command
