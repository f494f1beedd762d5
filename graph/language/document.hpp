// SPDX-License-Identifier: Apache-2.0
// A YAML file as JSON plus the position of every key and value. The YAML subset is the one on which all YAML readers
// agree: no anchors, aliases, tags, merge keys, second documents, no `010`, `0x10`, `1:30`, `yes`, `no`.
#pragma once
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt::graph {

/// Where one value stands and how it was written.
struct Mark {
  Position key;  ///< of its key; of the value itself for list items and the root
  Position value;
  std::string raw;  ///< a scalar as it stands in the file, before ${TAKT_DATA} is expanded
};

/// The version of the language of graph, schedule, parameter, scenario and overlay files: the `1` of `takt: 1`.
inline constexpr int kLanguage = 1;

class Document {
 public:
  std::string file;
  nlohmann::json root;                            ///< null if the file could not be read at all
  bool newer = false;                             ///< it could not, being of a later version than kLanguage
  std::map<std::string, Mark> marks;              ///< by JSON pointer (RFC 6901)
  std::map<std::string, std::string> unresolved;  ///< texts with ${constant}, by pointer; see Constants::later
  std::set<std::string> broken;                   ///< pointers whose value was reported already and is null or absent

  /// Position of the value; of its nearest parent if there is none.
  Position value_at(const std::string& pointer) const;
  Position key_at(const std::string& pointer) const;
  /// A scalar as it was written ("7.50"), "" for anything else.
  std::string raw(const std::string& pointer) const;

 private:
  const Mark* mark_near(const std::string& pointer) const;
};

/// "/devices" + "a/b" -> "/devices/a~1b".
std::string child(const std::string& pointer, std::string_view key);
std::string child(const std::string& pointer, size_t index);

/// What becomes of ${name} in a text, where name is a word of lower-case letters: an error, or it is left for the
/// caller (in Document::unresolved).
enum class Constants : uint8_t { none, later };

/// Reads and parses; what is wrong is appended to `problems` (all that can be found), each with its position.
/// `wanted_from` is where the file was asked for, for the error if it cannot be read.
Document read_document(const std::filesystem::path& file, const Position& wanted_from, std::vector<Problem>& problems,
                       Constants constants = Constants::none);
/// The same for text already in memory; `name` stands in the positions, relative paths start at `directory`.
Document parse_document(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                        std::vector<Problem>& problems, Constants constants = Constants::none);

/// The file that `include` of a document names.
std::filesystem::path included_file(const Document& from, const std::string& name);

/// A plain (unquoted) scalar as JSON, or why YAML readers disagree about it.
tl::expected<nlohmann::json, std::string> resolve_scalar(const std::string& text);

/// Replaces ${TAKT_DATA} by the environment variable (which must be set) and ${TAKT_DATA:-path} by the variable or, if
/// it is unset, by the path relative to `directory`.
tl::expected<std::string, std::string> expand_variables(const std::string& text, const std::filesystem::path& directory,
                                                        Constants constants = Constants::none);

}  // namespace takt::graph
