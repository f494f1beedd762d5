// SPDX-License-Identifier: Apache-2.0
#include "graph/language/document.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

#include "graph/language/words.hpp"
#include "rt/abi.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;
constexpr size_t kLargestFile = 1 << 20, kLongestScalar = 1000, kDeepest = 32;

/// Builds JSON and marks from parser events, so that duplicate keys are seen, which a YAML tree would hide.
class Builder final : public YAML::EventHandler {
 public:
  Builder(Document& document, const std::filesystem::path& directory, std::vector<Problem>& problems,
          Constants constants)
      : document_(document), directory_(directory), problems_(problems), constants_(constants) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { scalar(position(mark), json(), ""); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    problem(position(mark), "aliases (*name) are not part of the graph language; write the value out");
    scalar(position(mark), json(), "", false);
  }
  void OnAnchor(const YAML::Mark& mark, const std::string& name) override {
    problem(position(mark), "anchors (&" + name + ") are not part of the graph language; write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t, const std::string& value) override {
    const Position at = position(mark);
    if (!check_tag(at, tag)) return scalar(at, json(), value, false);
    if (value.size() > kLongestScalar) {
      problem(at, "text of " + std::to_string(value.size()) + " characters; at most " + std::to_string(kLongestScalar) +
                      " are allowed");
      return scalar(at, json(), "", false);
    }
    if (at_key()) return scalar(at, json(value), value);
    if (tag != "?") return text(at, value);
    const auto resolved = resolve_scalar(value);
    if (!resolved) {
      problem(at, resolved.error());
      return scalar(at, json(), value, false);
    }
    if (resolved->is_string()) return text(at, value);
    scalar(at, *resolved, value);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, json::array());
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t, YAML::EmitterStyle::value) override {
    open(mark, tag, json::object());
  }
  void OnMapEnd() override { close(); }

 private:
  /// An open map or list. `value` is null inside a key or a duplicate, whose contents go nowhere.
  struct Level {
    json value;
    std::string pointer;
    Position begin;
    bool expects_key = false, lost = false;
    std::string key;
    Position key_position;
    bool key_lost = false;
  };

  Position position(const YAML::Mark& mark) const {
    return {document_.file, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1};
  }
  void problem(const Position& at, std::string text) { problems_.push_back({at, std::move(text)}); }
  bool at_key() const { return !levels_.empty() && levels_.back().expects_key; }

  bool check_tag(const Position& at, const std::string& tag) {
    if (tag.empty() || tag == "?" || tag == "!") return true;
    problem(at, "tags (" + tag + ") are not part of the graph language; leave it out");
    return false;
  }

  void text(const Position& at, const std::string& value) {
    const auto expanded = expand_variables(value, directory_, constants_);
    if (!expanded) {
      problem(at, ticked(value) + " " + expanded.error());
      return scalar(at, json(value), value);
    }
    if (!next_lost() && expanded->find("${") != std::string::npos) document_.unresolved[next_pointer()] = *expanded;
    scalar(at, json(*expanded), value);
  }

  /// `known` is false where a problem was reported already: the value is then absent, so that nothing follows from it.
  void scalar(const Position& at, json value, std::string raw, bool known = true) {
    if (at_key()) return key(at, known ? value : json());
    place(at, std::move(value), std::move(raw), known);
  }

  void key(const Position& at, const json& value) {
    Level& level = levels_.back();
    level.expects_key = false;
    level.key_position = at;
    level.key_lost = true;
    if (!value.is_string()) return problem(at, "a key must be a word");
    level.key = value.get<std::string>();
    if (level.key == "<<") return problem(at, "merge keys (<<) are not part of the graph language; write the keys out");
    const auto first = document_.marks.find(child(level.pointer, level.key));
    if (level.value.contains(level.key) || seen(level, level.key)) {
      const std::string where =
          first == document_.marks.end() ? "" : "; the first stands in line " + std::to_string(first->second.key.line);
      return problem(at, "duplicate key " + ticked(level.key) + where);
    }
    level.key_lost = level.lost;
    if (!level.lost) document_.marks[child(level.pointer, level.key)] = {at, at, ""};
  }
  bool seen(const Level& level, const std::string& key) const {
    return !level.lost && document_.marks.contains(child(level.pointer, key));
  }

  std::string next_pointer() const {
    if (levels_.empty()) return "";
    const Level& level = levels_.back();
    return level.value.is_array() ? child(level.pointer, level.value.size()) : child(level.pointer, level.key);
  }
  bool next_lost() const {
    return !levels_.empty() && (levels_.back().lost || (levels_.back().value.is_object() && levels_.back().key_lost));
  }

  void place(const Position& at, json value, std::string raw, bool known) {
    const bool lost = next_lost();
    if (!lost) {
      const std::string pointer = next_pointer();
      Mark& mark = document_.marks[pointer];
      if (mark.key.line == 0) mark.key = at;
      mark.value = at;
      mark.raw = std::move(raw);
      if (!known) document_.broken.insert(pointer);
    }
    if (levels_.empty()) {
      if (known) document_.root = std::move(value);
      return;
    }
    Level& level = levels_.back();
    if (level.value.is_array()) {
      level.value.push_back(std::move(value));
    } else {
      if (!lost && known) level.value[level.key] = std::move(value);
      level.expects_key = true;
    }
  }

  void open(const YAML::Mark& mark_of_yaml, const std::string& tag, json empty) {
    const Position at = position(mark_of_yaml);
    check_tag(at, tag);
    if (levels_.size() == kDeepest)
      throw YAML::ParserException(mark_of_yaml, "nested deeper than " + std::to_string(kDeepest) + " levels");
    Level level;
    level.lost = at_key() || next_lost();
    level.pointer = level.lost ? "" : next_pointer();
    level.begin = at;
    level.expects_key = empty.is_object();
    level.value = std::move(empty);
    if (!level.lost) {
      Mark& mark = document_.marks[level.pointer];
      if (mark.key.line == 0) mark.key = at;
      mark.value = at;
    }
    levels_.push_back(std::move(level));
  }

  void close() {
    Level level = std::move(levels_.back());
    levels_.pop_back();
    if (at_key()) return key(level.begin, json());
    place(level.begin, std::move(level.value), "", true);
  }

  Document& document_;
  const std::filesystem::path& directory_;
  std::vector<Problem>& problems_;
  Constants constants_;
  std::vector<Level> levels_;
};

void add(std::vector<Problem>& problems, Position at, std::string text) {
  problems.push_back({std::move(at), std::move(text)});
}

/// Position of the first byte that is no UTF-8 or a control character, if there is one.
std::optional<Position> bad_byte(std::string_view text, const std::string& name) {
  Position at{name, 1, 1};
  for (size_t i = 0; i < text.size();) {
    const auto byte = [&](size_t k) { return static_cast<unsigned char>(i + k < text.size() ? text[i + k] : '\0'); };
    const unsigned char c = byte(0);
    const size_t length = c < 0x80                ? 1
                          : c >= 0xC2 && c < 0xE0 ? 2
                          : c >= 0xE0 && c < 0xF0 ? 3
                          : c >= 0xF0 && c < 0xF5 ? 4
                                                  : 0;
    bool bad = length == 0 || c == 0x7F || (c < 0x20 && c != '\n' && c != '\t' && c != '\r');
    for (size_t k = 1; k < length; ++k) bad = bad || (byte(k) & 0xC0) != 0x80;
    // Overlong forms, surrogates and what lies beyond Unicode.
    bad = bad || (c == 0xE0 && byte(1) < 0xA0) || (c == 0xED && byte(1) >= 0xA0) || (c == 0xF0 && byte(1) < 0x90) ||
          (c == 0xF4 && byte(1) >= 0x90);
    if (bad) return at;
    i += length;
    at.column++;
    if (c == '\n') at.line++, at.column = 1;
  }
  return std::nullopt;
}

}  // namespace

std::string child(const std::string& pointer, std::string_view key) {
  std::string result = pointer + "/";
  for (const char c : key) {
    if (c == '~') result += "~0";
    else if (c == '/') result += "~1";
    else result += c;
  }
  return result;
}

std::string child(const std::string& pointer, size_t index) { return pointer + "/" + std::to_string(index); }

const Mark* Document::mark_near(const std::string& pointer) const {
  for (std::string p = pointer;; p.resize(p.rfind('/'))) {
    if (const auto it = marks.find(p); it != marks.end()) return &it->second;
    if (p.empty() || p.rfind('/') == std::string::npos) return nullptr;
  }
}

Position Document::value_at(const std::string& pointer) const {
  const Mark* mark = mark_near(pointer);
  return mark != nullptr ? mark->value : Position{file, 1, 1};
}

Position Document::key_at(const std::string& pointer) const {
  const Mark* mark = mark_near(pointer);
  return mark != nullptr ? mark->key : Position{file, 1, 1};
}

std::string Document::raw(const std::string& pointer) const {
  const auto it = marks.find(pointer);
  return it == marks.end() ? "" : it->second.raw;
}

Document parse_document(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                        std::vector<Problem>& problems, Constants constants) {
  const Position start{name, 1, 1};
  Document document;
  document.file = name;
  if (const auto at = bad_byte(text, name)) {
    add(problems, *at, "this byte is no UTF-8 text; save the file as UTF-8 without control characters");
    return document;
  }
  const size_t before = problems.size();
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    Builder builder(document, directory, problems, constants);
    if (!parser.HandleNextDocument(builder)) {
      add(problems, start, "the file is empty; it begins with `takt: 1`");
    } else if (parser) {
      Document rest;
      rest.file = name;
      std::vector<Problem> ignored;
      Builder second(rest, directory, ignored, constants);
      if (parser.HandleNextDocument(second))
        add(problems, rest.value_at(""), "a second YAML document (---); one file holds one graph or schedule");
    }
  } catch (const YAML::Exception& error) {
    const Position at = error.mark.is_null() ? start : Position{name, error.mark.line + 1, error.mark.column + 1};
    add(problems, at, "no valid YAML: " + error.msg);
    document.root = json();
  } catch (const std::exception& error) {
    add(problems, start, std::string("no valid YAML: ") + error.what());
    document.root = json();
  }
  if (document.root.is_object() && document.root.value("takt", json()).is_number_integer() &&
      document.root["takt"] > kLanguage) {  // what else is wrong with it, is not wrong for a later Takt
    problems.erase(problems.begin() + static_cast<std::ptrdiff_t>(before), problems.end());
    document.newer = true;
    document.root = json();
    add(problems, document.value_at("/takt"),
        "the file is of version " + document.raw("/takt") + " of the language, and this is Takt " + version().number +
            ", which reads version " + std::to_string(kLanguage) + "; use a later Takt");
  }
  if (document.root.is_null() && problems.size() == before)
    add(problems, document.value_at(""), "the file holds no value; it begins with `takt: 1`");
  return document;
}

Document read_document(const std::filesystem::path& file, const Position& wanted_from, std::vector<Problem>& problems,
                       Constants constants) {
  Document nothing;
  nothing.file = file.string();
  const auto fail = [&](const std::string& why) {
    problems.push_back({wanted_from, "cannot read " + ticked(file.string()) + ": " + why});
    return nothing;
  };
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return fail("there is no such file; check the path");
  if (!std::filesystem::is_regular_file(file, error)) return fail("it is no file");
  const auto size = std::filesystem::file_size(file, error);
  if (error) return fail(error.message());
  if (size > kLargestFile) return fail("it is larger than 1 MiB");
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return fail("no permission, or a read error");
  return parse_document(text, file.string(), file.parent_path(), problems, constants);
}

}  // namespace takt::graph
