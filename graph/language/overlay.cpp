// SPDX-License-Identifier: Apache-2.0
#include "graph/language/overlay.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "graph/language/quantity.hpp"
#include "graph/language/words.hpp"

namespace takt::graph {
namespace {

bool is_set(const char* value) { return value != nullptr && *value != '\0'; }

/// True if YAML and takt take the word for what it is without quotes.
bool stands_plain(const std::string& text) {
  const auto scalar = resolve_scalar(text);
  return scalar && (scalar->is_number() || scalar->is_boolean() || parse_quantity(text));
}

std::string in_quotes(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
  return result + "\"";
}

/// A value as it is written into the file.
std::string written(const Overlay::Value& value) {
  const auto scalar = resolve_scalar(value.text);
  const bool word = value.value.is_string() && !(scalar && scalar->is_string() && parse_quantity(value.text));
  return word ? in_quotes(value.text) : value.text;
}

std::string file_of(const std::string& graph, const std::map<std::string, std::string>& values) {
  std::string text = fmt::format(
      "# Values that `takt set --keep` gave to the graph {}; `takt run`, `check` and `profile` use them.\n"
      "# Change them here, or take one out: takt set --forget NODE.PARAM. Comments are not kept.\n"
      "takt: 1\ngraph: {}\nvalues:{}\n",
      graph, graph, values.empty() ? " {}" : "");
  for (const auto& [name, value] : values) text += fmt::format("  {}: {}\n", name, value);
  return text;
}

/// Writes and makes sure that it is on the disk. 0, or errno.
int write_all(const std::filesystem::path& file, const std::string& text) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) return errno;
  int problem = 0;
  for (size_t done = 0; problem == 0 && done < text.size();) {
    const ssize_t count = write(descriptor, text.data() + done, text.size() - done);
    if (count > 0) done += static_cast<size_t>(count);
    else if (errno != EINTR) problem = errno;
  }
  if (problem == 0 && fsync(descriptor) != 0) problem = errno;
  close(descriptor);
  return problem;
}

}  // namespace

std::filesystem::path state_folder(const char* takt_state, const char* state_directory, const char* state_home,
                                   const char* home) {
  if (is_set(takt_state)) return takt_state;
  if (is_set(state_directory)) return std::string(state_directory, std::strcspn(state_directory, ":"));
  if (is_set(state_home)) return std::filesystem::path(state_home) / "takt";
  if (is_set(home)) return std::filesystem::path(home) / ".local/state/takt";
  return {};
}

std::filesystem::path state_folder() {
  return state_folder(std::getenv("TAKT_STATE_DIR"), std::getenv("STATE_DIRECTORY"), std::getenv("XDG_STATE_HOME"),
                      std::getenv("HOME"));
}

std::filesystem::path overlay_file(const std::filesystem::path& state_folder, const std::string& graph) {
  return state_folder.empty() ? std::filesystem::path() : state_folder / "overlays" / (graph + ".yaml");
}

std::string overlay_remedy(const std::string& param) {
  return "; edit the file, or: takt set --forget " + param + " (--no-overlay runs without the file)";
}

Overlay read_overlay(const std::filesystem::path& file, const std::string& graph, std::vector<Problem>& problems) {
  Overlay overlay;
  std::error_code error;
  if (file.empty() || !std::filesystem::exists(file, error)) return overlay;
  const Document document = read_document(file, {file.string(), 0, 0}, problems);
  if (document.root.is_null()) return overlay;
  const auto problem = [&](const Position& at, const std::string& text) {
    problems.push_back({at, text + "; edit the file, or remove it (--no-overlay runs without it)"});
  };
  if (!document.root.is_object())
    return problem(document.value_at(""), "a map is wanted: takt, graph, values"), overlay;
  for (const auto& [key, value] : document.root.items()) {
    const std::string pointer = child("", key);
    if (key == "takt" && value != nlohmann::json(1)) problem(document.value_at(pointer), "takt must be 1");
    if (key == "graph" && value != nlohmann::json(graph))
      problem(document.value_at(pointer), fmt::format("the file is of another graph than {}", ticked(graph)));
    if (key != "takt" && key != "graph" && key != "values")
      problem(document.key_at(pointer),
              fmt::format("unknown key {}{}", ticked(key), alternatives(key, {"takt", "graph", "values"})));
  }
  if (!document.root.contains("takt")) problem(document.value_at(""), "the key `takt: 1` is missing");
  if (!document.root.contains("values")) return overlay;
  const nlohmann::json& values = document.root["values"];
  if (!values.is_object()) return problem(document.value_at("/values"), "`values` must be a map"), overlay;
  for (const auto& [name, value] : values.items()) {
    const std::string pointer = child("/values", name);
    const size_t dot = name.find('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == name.size() || !value.is_primitive() || value.is_null())
      problem(document.key_at(pointer), ticked(name) + " is not understood; write node.param: value");
    else
      overlay.values.push_back({name.substr(0, dot), name.substr(dot + 1), document.raw(pointer), value,
                                document.key_at(pointer), document.value_at(pointer)});
  }
  return overlay;
}

tl::expected<void, std::string> forget_value(const std::filesystem::path& file, const std::string& graph,
                                             const std::string& name) {
  std::vector<Problem> problems;
  std::vector<std::string> names;
  for (const Overlay::Value& value : read_overlay(file, graph, problems).values)
    names.push_back(value.node + "." + value.param);
  if (problems.empty() && std::find(names.begin(), names.end(), name) == names.end())
    return tl::make_unexpected(
        fmt::format("{} holds no value of {}{}", file.string(), ticked(name), alternatives(name, names, "it holds")));
  return change_overlay(file, graph, {{name, ""}});
}

tl::expected<void, std::string> change_overlay(const std::filesystem::path& file, const std::string& graph,
                                               const OverlayChanges& changes) {
  if (file.empty()) return tl::make_unexpected("no folder for state is known; set TAKT_STATE_DIR");
  std::vector<Problem> problems;
  std::map<std::string, std::string> values;
  for (const Overlay::Value& value : read_overlay(file, graph, problems).values)
    values[value.node + "." + value.param] = written(value);
  if (!problems.empty()) return tl::make_unexpected(to_string(problems.front()));
  for (const auto& [name, text] : changes) {
    if (std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }))
      return tl::make_unexpected(name + ": a value with control characters cannot be kept");
    if (text.empty()) values.erase(name);
    else values[name] = stands_plain(text) ? text : in_quotes(text);
  }
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  const std::filesystem::path beside = file.string() + ".new";
  int failed = error ? error.value() : write_all(beside, file_of(graph, values));
  if (failed == 0 && rename(beside.c_str(), file.c_str()) != 0) failed = errno;
  if (failed == 0) return {};
  return tl::make_unexpected(
      fmt::format("{}: {}; name a writable folder with TAKT_STATE_DIR", file.string(), std::strerror(failed)));
}

}  // namespace takt::graph
