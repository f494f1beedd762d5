// SPDX-License-Identifier: Apache-2.0
#include "graph/keys/machine_keys.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <fstream>

#include "graph/keys/documents.hpp"
#include "rt/file/input_file.hpp"

namespace takt::keys {
namespace {

namespace fs = std::filesystem;

constexpr std::time_t kSoon_s = 30 * 86'400;

std::string wrong_file(const fs::path& folder, const graph::GraphSpec& graph) {
  if (const auto below = folder / graph.machine; fs::exists(below / kPrivateKey))
    return fmt::format("{} has the keys of all machines: give --keys {}, and copy no other folder to this machine",
                       folder.string(), below.string());
  for (const char* name : {kAuthority, kCertificate, kPrivateKey, kGovernance, kPermissions, kNotes})
    if (const std::string why = why_unreadable(folder / name); !why.empty())
      return fmt::format("{} {}; `takt keys {} --out FOLDER` makes the keys, FOLDER/{} are those of this machine",
                         (folder / name).string(), why, graph.file, graph.machine);
  const fs::path key = folder / kPrivateKey;
  struct stat found {};
  if (stat(key.c_str(), &found) == 0 && (found.st_mode & 077) != 0)
    return fmt::format("others can read {0} (mode {1:o}); run:  chmod 600 {0}", key.string(), found.st_mode & 0777);
  return "";
}

std::string wrong_owner(const fs::path& folder, const KeyNotes& notes, const graph::GraphSpec& graph, std::time_t now) {
  const auto differ = [&](const std::string& what, const std::string& have, const std::string& want) {
    return fmt::format("{} has keys for {} {}, this is {}; give those of this one, or make them with `takt keys {}`",
                       folder.string(), what, have, want, graph.file);
  };
  if (notes.graph != graph.name) return differ("graph", notes.graph, graph.name);
  if (notes.machine != graph.machine) return differ("machine", notes.machine, graph.machine);
  if (notes.domain != graph.network.domain)
    return differ("domain", std::to_string(notes.domain), std::to_string(graph.network.domain));
  if (notes.until <= now)
    return fmt::format(
        "the keys in {} ended on {}; remove the folder of the machine where they were made, and call "
        "`takt keys {}` there again",
        folder.string(), utc(notes.until), graph.file);
  return "";
}

}  // namespace

nlohmann::ordered_json to_json(const KeyNotes& notes) {
  return {{"takt", 1},
          {"graph", notes.graph},
          {"machine", notes.machine},
          {"domain", notes.domain},
          {"until", utc(notes.until)}};
}

KeyNotes read_notes(const fs::path& folder) {
  const fs::path file = folder / kNotes;
  require_readable(file);
  std::ifstream in(file);
  try {
    const auto json = nlohmann::json::parse(in);
    std::tm until{};
    const auto text = json.at("until").get<std::string>();
    if (const char* end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &until); end == nullptr || *end != '\0')
      throw std::runtime_error("`until` is no time");
    return {json.at("graph").get<std::string>(), json.at("machine").get<std::string>(), json.at("domain").get<int>(),
            timegm(&until)};
  } catch (const std::exception& problem) {
    throw std::runtime_error(fmt::format("{}: not as `takt keys` writes it: {}", file.string(), problem.what()));
  }
}

KeyCheck check_keys(const fs::path& folder, const graph::GraphSpec& graph, std::time_t now) {
  if (graph.machine.empty())
    return {"--keys belongs to --machine: a graph on one computer sends nothing over a network", ""};
  if (std::string wrong = wrong_file(folder, graph); !wrong.empty()) return {std::move(wrong), ""};
  try {
    const KeyNotes notes = read_notes(folder);
    if (std::string wrong = wrong_owner(folder, notes, graph, now); !wrong.empty()) return {std::move(wrong), ""};
    if (notes.until - now < kSoon_s)
      return {"", fmt::format("the keys in {} end on {}", folder.string(), utc(notes.until))};
  } catch (const std::runtime_error& problem) {
    return {problem.what(), ""};
  }
  return {};
}

}  // namespace takt::keys
