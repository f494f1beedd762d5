// SPDX-License-Identifier: Apache-2.0
// The files of a graph: what it includes, its constants, and the parameter file of one robot. All of them become one
// document, whose marks name the file and line of each value.
#include <fmt/format.h>

#include <algorithm>

#include "graph/language/loader.hpp"
#include "graph/language/schema.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

std::filesystem::path canonical_path(const std::filesystem::path& file) {
  std::error_code ignored;
  return std::filesystem::weakly_canonical(std::filesystem::absolute(file, ignored), ignored);
}

/// Maps whose entries come from several files; the entries of `profiles` are merged again, down to the settings.
int merged_levels(const std::string& key) {
  if (key == "profiles") return 4;
  return key == "devices" || key == "subsystems" || key == "chains" || key == "modes" || key == "constants" ? 1 : 0;
}

/// A graph file with everything that it includes.
class Parts {
 public:
  Parts(std::vector<std::string>& files, std::vector<Problem>& problems) : files_(files), problems_(problems) {}

  Document read(const std::filesystem::path& file, const Position& wanted_from) {
    Document whole = read_document(file, wanted_from, problems_, Constants::later);
    newer_ = newer_ || whole.newer;
    files_.push_back(file.string());
    if (!whole.root.is_object()) return whole;
    open_.push_back(canonical_path(file));
    const json list = whole.root.value("include", json());
    for (size_t i = 0; list.is_array() && i < list.size(); ++i)
      if (list[i].is_string()) include(whole, list[i].get<std::string>(), child("/include", i));
    open_.pop_back();
    return whole;
  }

  /// One of the files is of a later version: what the others lack means nothing.
  bool newer() const { return newer_; }

 private:
  void problem(const Position& at, std::string text) { problems_.push_back({at, std::move(text)}); }

  void include(Document& whole, const std::string& name, const std::string& pointer) {
    const Position at = whole.value_at(pointer);
    if (whole.broken.contains(pointer)) return;
    if (name.find("${") != std::string::npos)
      return problem(at, ticked(name) + ": a path of `include` takes no constants; write the path out");
    const std::filesystem::path file = included_file(whole, name);
    const std::filesystem::path key = canonical_path(file);
    if (std::find(open_.begin(), open_.end(), key) != open_.end()) {
      std::string from =
          open_.size() > 1 ? fmt::format("; it is included at {}", to_string(first_.at(open_.back()))) : "";
      return problem(at, fmt::format("{} includes itself{}; take one `include` out", ticked(name), from));
    }
    const auto [first, fresh] = first_.emplace(key, at);
    if (!fresh)
      return problem(
          at, fmt::format("{} is included twice; the first stands at {}", ticked(name), to_string(first->second)));
    const size_t before = problems_.size();
    const Document part = read(file, at);
    if (part.root.is_object()) merge(whole, part);
    else if (problems_.size() == before)
      problem(part.value_at(""), "an included file is a map that begins with `takt: 1`");
  }

  void merge(Document& whole, const Document& part) {
    if (!part.root.contains("takt") && !part.broken.contains("/takt"))
      problem(part.value_at(""), "the key `takt: 1` is missing");
    for (const auto& [key, value] : part.root.items()) {
      const std::string pointer = child("", key);
      if (key == "include") continue;
      if (key == "takt") {
        if (value != json(1)) problem(part.value_at(pointer), "takt must be 1");
        continue;
      }
      const int levels = merged_levels(key);
      if (!whole.root.contains(key)) take(whole, part, pointer);
      else if (key == "plugins") append(whole, part, pointer);
      else if (levels > 0) merge_map(whole, part, pointer, levels);
      else if (whole.value_at(pointer).file != whole.file) twice(whole, part, pointer);  // else: its own word wins
    }
    whole.broken.insert(part.broken.begin(), part.broken.end());
  }

  void merge_map(Document& whole, const Document& part, const std::string& pointer, int levels) {
    const json::json_pointer where(pointer);
    if (!whole.root.at(where).is_object() || !part.root.at(where).is_object()) return twice(whole, part, pointer);
    for (const auto& [key, value] : part.root.at(where).items()) {
      const std::string below = child(pointer, key);
      const bool both = whole.root.at(where).contains(key);
      if (!both) take(whole, part, below);
      else if (levels > 1 && value.is_object() && whole.root.at(where).at(key).is_object())
        merge_map(whole, part, below, levels - 1);
      else twice(whole, part, below);
    }
  }

  /// Both lists are one.
  void append(Document& whole, const Document& part, const std::string& pointer) {
    const json::json_pointer where(pointer);
    if (!whole.root.at(where).is_array() || !part.root.at(where).is_array()) return twice(whole, part, pointer);
    for (size_t i = 0; i < part.root.at(where).size(); ++i)
      take(whole, part, child(pointer, i), child(pointer, whole.root.at(where).size()));
  }

  void twice(const Document& whole, const Document& part, const std::string& pointer) {
    const size_t slash = pointer.rfind('/');
    const std::string in = slash == 0 ? "the graph" : ticked(pointer.substr(1, slash - 1));
    problem(part.key_at(pointer), fmt::format("duplicate {} in {}; the first stands at {}",
                                              ticked(pointer.substr(slash + 1)), in, to_string(whole.key_at(pointer))));
  }

  static void take(Document& whole, const Document& part, const std::string& pointer) {
    take(whole, part, pointer, pointer);
  }
  static void take(Document& whole, const Document& part, const std::string& pointer, const std::string& to_pointer) {
    whole.root[json::json_pointer(to_pointer)] = part.root.at(json::json_pointer(pointer));
    const auto copy = [&](const auto& from, auto& to) {
      for (const auto& [place, what] : from)
        if (place == pointer || place.starts_with(pointer + "/")) to[to_pointer + place.substr(pointer.size())] = what;
    };
    copy(part.marks, whole.marks);
    copy(part.unresolved, whole.unresolved);
  }

  bool newer_ = false;
  std::vector<std::string>& files_;
  std::vector<Problem>& problems_;
  std::vector<std::filesystem::path> open_;          ///< from the graph to the file that is read
  std::map<std::filesystem::path, Position> first_;  ///< where a file was included
};

}  // namespace

std::filesystem::path included_file(const Document& from, const std::string& name) {
  return (std::filesystem::path(from.file).parent_path() / name).lexically_normal();
}

bool Loader::before(const Position& a, const Position& b) const {
  const auto rank = [&](const Position& at) { return std::find(spec_.files.begin(), spec_.files.end(), at.file); };
  return std::tuple(rank(a), a.line, a.column) < std::tuple(rank(b), b.line, b.column);
}

void Loader::read_files(const std::filesystem::path& file) {
  Parts parts(spec_.files, problems_);
  graph_ = parts.read(file, {file.string(), 0, 0});
  if (parts.newer()) {
    graph_.root = json();
    return;
  }
  if (options_.params.empty()) {
    take_constants(graph_, false);
  } else {
    params_ = read_document(options_.params, {"--params", 0, 0}, problems_, Constants::later);
    spec_.params_file = options_.params.string();
    spec_.files.push_back(spec_.params_file);
    take_constants(graph_, false);
    take_constants(params_, true);
    fill_constants(params_);
    if (!params_.root.is_null()) validate(params_, Schema::params, problems_);
  }
  fill_constants(graph_);
  if (!graph_.root.is_null()) validate(graph_, Schema::graph, problems_);
}

/// Those of the robot replace those of the graph, which must have them.
void Loader::take_constants(Document& document, bool of_robot) {
  if (!document.root.is_object() || !document.root.contains("constants")) return;
  const json constants = document.root["constants"];
  if (!constants.is_object()) return;  // the schema reports it
  std::vector<std::string> names;
  for (const auto& [name, constant] : constants_) names.push_back(name);
  for (const auto& [name, value] : constants.items()) {
    const std::string pointer = child("/constants", name);
    if (document.unresolved.erase(pointer) > 0)
      problem(document.value_at(pointer),
              fmt::format("constant {} names a constant; write its value out", ticked(name)));
    else if (of_robot && !constants_.contains(name))
      problem(document.key_at(pointer),
              fmt::format("the graph has no constant {}{}", ticked(name), alternatives(name, names, "constants")));
    else if (value.is_primitive() && !value.is_null())
      constants_[name] = {value, document.raw(pointer), document.value_at(pointer)};
  }
}

void Loader::fill_constants(Document& document) {
  for (const auto& [pointer, text] : document.unresolved) {
    const json::json_pointer where(pointer);
    if (!document.root.contains(where)) continue;
    Mark& mark = document.marks[pointer];
    if (auto filled = filled_in(text, mark)) document.root[where] = std::move(*filled);
    else {
      document.broken.insert(pointer);
      json& parent = document.root[where.parent_pointer()];
      if (parent.is_object()) parent.erase(where.back());
      else document.root[where] = json();
    }
  }
  document.unresolved.clear();
}

/// The text with its constants, which becomes the mark's; nothing if that was reported.
std::optional<json> Loader::filled_in(const std::string& text, Mark& mark) {
  const Position used = mark.value;
  std::string raw;
  for (size_t at = 0;;) {
    const size_t begin = text.find("${", at);
    raw += text.substr(at, begin - at);
    if (begin == std::string::npos) break;
    const size_t end = text.find('}', begin);  // the reader saw to it that there is one
    const std::string name = text.substr(begin + 2, end - begin - 2);
    const auto constant = constants_.find(name);
    if (constant == constants_.end()) {
      std::vector<std::string> names;
      for (const auto& [known, value] : constants_) names.push_back(known);
      problem(used, fmt::format("{}: there is no constant {}{}", ticked(text), ticked(name),
                                alternatives(name, names, "constants")));
      return std::nullopt;
    }
    if (mark.value.use.empty()) {
      mark.value = constant->second.position;
      mark.value.use = fmt::format("constant {}, used at {}", ticked(name), to_string(used));
    }
    at = end + 1;
    if (begin == 0 && at == text.size()) {
      mark.raw = constant->second.raw;
      return constant->second.value;
    }
    const json& value = constant->second.value;
    raw += value.is_string() ? value.get<std::string>() : constant->second.raw;
  }
  mark.raw = raw;
  const auto value = resolve_scalar(raw);
  if (value) return *value;
  problem(mark.value, value.error());
  return std::nullopt;
}

void Loader::read_robot() {
  const json& root = params_.root;
  if (!root.is_object()) return;
  if (root.contains("graph") && root["graph"] != json(spec_.name))
    problem(params_.value_at("/graph"), fmt::format("the file is of another graph than {}", ticked(spec_.name)));
  for (const char* part : {"nodes", "devices"}) {
    const json entries = root.value(part, json());
    if (!entries.is_object()) continue;
    std::vector<std::string> known;
    if (part == std::string_view("nodes"))
      for (const auto& node : spec_.nodes) known.push_back(node.id);
    else
      for (const auto& device : spec_.devices) known.push_back(device.id);
    for (const auto& [id, values] : entries.items()) {
      const std::string pointer = child(child("", part), id);
      if (std::find(known.begin(), known.end(), id) == known.end())
        problem(params_.key_at(pointer),
                fmt::format("{} is none of the graph's {}{}", ticked(id), part, alternatives(id, known)));
      else read_robot_values(id, "", values, pointer);
    }
  }
}

void Loader::read_robot_values(const std::string& id, const std::string& prefix, const json& values,
                               const std::string& pointer) {
  if (!values.is_object()) return;
  for (const auto& [name, value] : values.items()) {
    const std::string below = child(pointer, name);
    if (value.is_object()) read_robot_values(id, prefix + name + ".", value, below);
    else if (!params_.broken.contains(below)) set_.push_back({id, prefix + name, given(params_, below, value)});
  }
}

}  // namespace takt::graph
