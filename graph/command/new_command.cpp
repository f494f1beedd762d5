// SPDX-License-Identifier: Apache-2.0
#include "graph/command/new_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <system_error>

#include "graph/cli/outcome.hpp"

namespace takt::command {
namespace {

namespace fs = std::filesystem;

std::string class_name(const std::string& name) {
  std::string made;
  bool begins = true;
  for (const char c : name) {
    if (c != '_') made += begins ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    begins = c == '_';
  }
  return made;
}

/// The templates' files into `folder`, which is empty. Throws std::system_error or std::ios_base::failure.
void write_files(const fs::path& templates, const fs::path& folder, const std::string& name) {
  for (const auto& entry : fs::directory_iterator(templates)) {
    std::ifstream in;
    in.exceptions(std::ios::badbit | std::ios::failbit);
    in.open(entry.path(), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    std::ofstream out;
    out.exceptions(std::ios::badbit | std::ios::failbit);
    // The suffix .in keeps compilers and editors off the templates.
    out.open(folder / filled(entry.path().stem(), name), std::ios::binary);
    out << filled(text, name);
    out.close();
  }
}

int make_project(const std::string& name) {
  static const std::regex allowed("[a-z][a-z0-9_]{0,39}");
  if (!std::regex_match(name, allowed))
    return refuse(
        fmt::format("`{}` is no name of a project; write a small letter, then small letters, digits and _, at "
                    "most 40 in all, for instance blue_robot",
                    name),
        kBadInput);
  std::error_code error;
  if (fs::exists(fs::symlink_status(name, error)))
    return refuse(fmt::format("{} exists already; choose another name or another folder", fs::absolute(name).string()),
                  kBadInput);
  const fs::path templates = shipped("graph/new");
  if (!fs::is_directory(templates, error))
    return refuse(fmt::format("the templates are missing: {} is no folder; install Takt again, or set TAKT_HOME to a "
                              "checkout",
                              templates.string()),
                  kDeviceOrSystem);
  // Beside its place under another name first: nobody finds half a project.
  const fs::path half = fmt::format(".{}.{}", name, getpid());
  try {
    fs::create_directory(half);
    write_files(templates, half, name);
    fs::rename(half, name);
  } catch (const std::system_error& problem) {  // of streams, too
    fs::remove_all(half, error);
    return refuse(fmt::format("{}: cannot be written: {}", fs::absolute(name).string(), problem.code().message()),
                  kDeviceOrSystem);
  }
  fmt::print(
      "{0}/ is a project: a node, a message, a device with a simulated one, a graph, a schedule, a test\n"
      "next: cd {0} && cmake -S . -B build && cmake --build build && ctest --test-dir build && takt run\n",
      name);
  return kOk;
}

}  // namespace

std::string filled(const std::string& text, const std::string& name) {
  std::string made;
  for (size_t i = 0; i < text.size();) {
    if (text.compare(i, 6, "@NAME@") == 0) made += name, i += 6;
    else if (text.compare(i, 6, "@Name@") == 0) made += class_name(name), i += 6;
    else made += text[i++];
  }
  return made;
}

void add_new(CLI::App& app, NewOptions& options, int& exit_code) {
  CLI::App* command = app.add_subcommand("new", "writes a project to begin with: node, message, device, graph, test");
  command->add_option("name", options.name, "of the project and its folder")->required();
  command->callback([&] { exit_code = make_project(options.name); });
}

}  // namespace takt::command
