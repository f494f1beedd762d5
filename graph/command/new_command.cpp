// SPDX-License-Identifier: Apache-2.0
#include "graph/command/new_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <span>
#include <sstream>
#include <system_error>

#include "graph/cli/outcome.hpp"

namespace takt::command {
namespace {

namespace fs = std::filesystem;

constexpr size_t kLongestName = 40;

/// Words that C++ keeps for itself; and those that a build, this project or Takt has another use for.
constexpr std::string_view kKeywords[] = {
    "alignas",     "alignof",  "and",        "and_eq",    "asm",       "auto",         "bitand",
    "bitor",       "bool",     "break",      "case",      "catch",     "char",         "char8_t",
    "char16_t",    "char32_t", "class",      "co_await",  "co_return", "co_yield",     "compl",
    "concept",     "const",    "const_cast", "consteval", "constexpr", "constinit",    "continue",
    "decltype",    "default",  "delete",     "do",        "double",    "dynamic_cast", "else",
    "enum",        "explicit", "export",     "extern",    "false",     "float",        "for",
    "friend",      "goto",     "if",         "inline",    "int",       "long",         "mutable",
    "namespace",   "new",      "noexcept",   "not",       "not_eq",    "nullptr",      "operator",
    "or",          "or_eq",    "private",    "protected", "public",    "register",     "reinterpret_cast",
    "requires",    "return",   "short",      "signed",    "sizeof",    "static",       "static_assert",
    "static_cast", "struct",   "switch",     "template",  "this",      "thread_local", "throw",
    "true",        "try",      "typedef",    "typeid",    "typename",  "union",        "unsigned",
    "using",       "virtual",  "void",       "volatile",  "wchar_t",   "while",        "xor",
    "xor_eq"};
constexpr std::string_view kOthers[] = {"all",     "clean",          "depend",     "edit_cache",    "help",  "install",
                                        "package", "package_source", "preinstall", "rebuild_cache", "gauge", "schedule",
                                        "std",     "takt",           "test"};

bool small_letter(char c) { return c >= 'a' && c <= 'z'; }
bool digit(char c) { return c >= '0' && c <= '9'; }
bool one_of(std::span<const std::string_view> words, std::string_view name) {
  return std::find(words.begin(), words.end(), name) != words.end();
}

/// An error of the stream as the system's own, with its reason.
[[noreturn]] void fail(const fs::path& file) {
  throw fs::filesystem_error("", file, std::error_code(errno != 0 ? errno : EIO, std::generic_category()));
}

std::string content(const fs::path& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!(text << in.rdbuf())) fail(file);
  return std::move(text).str();
}

void write(const fs::path& file, const std::string& text) {
  errno = 0;
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) fail(file);
}

}  // namespace

std::string wrong_with_name(std::string_view name) {
  const bool well_formed =
      !name.empty() && name.size() <= kLongestName && small_letter(name.front()) && name.back() != '_' &&
      name.find("__") == std::string_view::npos &&
      std::all_of(name.begin(), name.end(), [](char c) { return small_letter(c) || digit(c) || c == '_'; });
  if (!well_formed)
    return fmt::format(
        "`{}` is no name of a project; use small letters, digits and single _ between them, a letter first, at most {} "
        "characters: for instance blue_robot",
        name, kLongestName);
  if (one_of(kKeywords, name))
    return fmt::format("`{0}` is a word of C++; choose another name, for instance {0}_robot", name);
  if (one_of(kOthers, name))
    return fmt::format(
        "the files or the build of a project use `{0}` for something else; choose another name, for instance "
        "{0}_robot",
        name);
  return "";
}

std::string filled(std::string_view text, std::string_view name) {
  constexpr std::string_view mark = "@NAME@";
  std::string made;
  for (size_t at = 0; at < text.size();) {
    const size_t next = std::min(text.find(mark, at), text.size());
    made += text.substr(at, next - at);
    if (next < text.size()) made += name;
    at = next + mark.size();
  }
  return made;
}

int make_project(const fs::path& templates, const std::string& name) {
  if (const std::string wrong = wrong_with_name(name); !wrong.empty()) return refuse(wrong, kBadInput);
  std::error_code error;
  const fs::path place = fs::absolute(name, error);
  if (fs::exists(fs::symlink_status(place, error)))
    return refuse(fmt::format("{} is there already; choose another name, or another folder to work in", place.string()),
                  kBadInput);
  if (!fs::is_directory(templates, error))
    return refuse(fmt::format("the files of a new project are missing: {} is no folder\n"
                              "  fix: install Takt again, or set TAKT_HOME to a checkout",
                              templates.string()),
                  kDeviceOrSystem);
  // Next to its place under another name first: nobody finds half a project.
  const fs::path half = place.parent_path() / fmt::format(".{}.{}", name, getpid());
  try {
    fs::create_directory(half);
    for (const auto& entry : fs::directory_iterator(templates))
      write(half / filled(entry.path().stem().string(), name), filled(content(entry.path()), name));
    fs::rename(half, place);
  } catch (const fs::filesystem_error& problem) {
    fs::remove_all(half, error);
    return refuse(
        fmt::format("{} cannot be made: {}: {}", place.string(), problem.path1().string(), problem.code().message()),
        kDeviceOrSystem);
  }
  fmt::print(
      "{0}/ is a project: node.hpp, device.hpp, main.cpp, test.cpp, {0}.yaml, schedule.yaml, CMakeLists.txt\n"
      "Next:\n"
      "  cd {0}\n"
      "  cmake -S . -B build && cmake --build build -j2\n"
      "  ctest --test-dir build\n"
      "  build/{0} run {0}.yaml --for 5s --record {0}.mcap\n"
      "  build/{0} replay {0}.mcap --compare\n",
      name);
  return kOk;
}

void add_new(CLI::App& app, NewOptions& options, int& exit_code) {
  CLI::App* command = app.add_subcommand("new", "makes a project of your own: node, message, device, graph, test");
  command->add_option("name", options.name, "of the project, its folder and its program")->required();
  command->footer("Example: takt new robot");
  command->callback([&] { exit_code = make_project(shipped("graph/new"), options.name); });
}

}  // namespace takt::command
