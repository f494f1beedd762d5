// SPDX-License-Identifier: Apache-2.0
#include "graph/language/edit_schedule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "graph/language/document.hpp"
#include "graph/language/quantity.hpp"

namespace takt::graph {
namespace {

constexpr int64_t kUs = 1'000, kMs = 1'000'000;

struct Edit {
  size_t begin, length;
  std::string text;
};

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string exec_text(int64_t ns) { return fmt::format("{}.{:03}ms", ns / kMs, ns / kUs % 1'000); }

std::string block_text(const MeasuredSpec& m) {
  std::string text = fmt::format(
      "measured:  # by takt profile: budget = margin x this quantile of the execution time\n"
      "  machine: {{cpu: {}, cores: {}, kernel: {}}}\n  at: {}\n  policy: {}\n  quantile: {:g}\n  margin: {:g}\n"
      "  nodes:{}\n",
      quoted(m.machine.cpu), m.machine.cores, quoted(m.machine.kernel), quoted(m.at), m.policy, m.quantile, m.margin,
      m.nodes.empty() ? " {}" : "");
  for (const auto& [id, exec] : m.nodes)
    text += fmt::format("    {}: {{exec: {}, samples: {}}}\n", id, exec_text(exec.exec_ns), exec.samples);
  return text;
}

class Editor {
 public:
  Editor(std::string_view text, const std::string& name) : text_(text), name_(name) {
    std::vector<Problem> problems;
    document_ = parse_document(text, name, {}, problems);
    if (!problems.empty()) problem_ = problems.front();
    else if (!document_.root.is_object() || text_.substr(offset(document_.value_at(""))).substr(0, 1) == "{")
      fail(document_.value_at(""), "a schedule in braces as a whole cannot be edited; write its keys one a line");
    else if (!document_.root.contains("nodes") || !document_.root["nodes"].is_object())
      fail(document_.value_at(""), "there is no map `nodes` to write budgets into");
  }

  tl::expected<std::string, Problem> edited(const std::map<std::string, int64_t>& budgets_ns,
                                            const MeasuredSpec& measured) {
    for (const auto& [id, ns] : budgets_ns)
      if (!problem_) set_budget(id, budget_text(ns));
    if (!problem_) set_block(block_text(measured));
    if (problem_) return tl::make_unexpected(*problem_);
    std::stable_sort(edits_.begin(), edits_.end(), [](const Edit& a, const Edit& b) { return a.begin > b.begin; });
    std::string result(text_);
    for (const Edit& edit : edits_) result.replace(edit.begin, edit.length, edit.text);
    check(result, budgets_ns);
    if (problem_) return tl::make_unexpected(*problem_);
    return result;
  }

 private:
  void fail(const Position& at, std::string text) { problem_ = Problem{at, std::move(text)}; }

  size_t line_begin(int line) const {
    size_t at = 0;
    for (int l = 1; l < line && at < text_.size(); ++l) at = std::min(text_.find('\n', at), text_.size() - 1) + 1;
    return at;
  }
  size_t offset(const Position& at) const {
    return std::min(line_begin(at.line) + static_cast<size_t>(at.column - 1), text_.size());
  }

  void set_budget(const std::string& id, const std::string& budget) {
    const std::string entry = child("/nodes", id), pointer = child(entry, "budget");
    if (document_.marks.contains(pointer)) return replace_scalar(pointer, budget);
    if (document_.marks.contains(entry)) return insert_first(entry, "budget: " + budget);
    insert_first("/nodes", id + ": {budget: " + budget + "}");
  }

  void replace_scalar(const std::string& pointer, const std::string& value) {
    const size_t at = offset(document_.value_at(pointer));
    const std::string raw = document_.raw(pointer);
    if (text_.substr(at, raw.size()) == raw) return edits_.push_back({at, raw.size(), value});
    const char quote = at < text_.size() ? text_[at] : '\0';
    if ((quote == '"' || quote == '\'') && text_.substr(at + 1, raw.size() + 1) == raw + quote)
      return edits_.push_back({at, raw.size() + 2, value});
    fail(document_.value_at(pointer), "this value cannot be replaced; write it on one line without escapes");
  }

  /// Puts `entry` in front of what stands first in the map.
  void insert_first(const std::string& map, const std::string& entry) {
    const size_t at = offset(document_.value_at(map));
    const auto& value = document_.root.at(nlohmann::json::json_pointer(map));
    if (!value.is_object()) return fail(document_.value_at(map), "this entry is no map");
    if (at < text_.size() && text_[at] == '{')
      return edits_.push_back({at + 1, 0, entry + (value.empty() ? "" : ", ")});
    const Position first = first_key(map, value);
    edits_.push_back({offset(first), 0, entry + "\n" + std::string(static_cast<size_t>(first.column - 1), ' ')});
  }

  Position first_key(const std::string& map, const nlohmann::json& value) const {
    std::optional<Position> first;
    for (const auto& [key, unused] : value.items()) {
      const Position at = document_.key_at(child(map, key));
      if (!first || std::pair(at.line, at.column) < std::pair(first->line, first->column)) first = at;
    }
    return first.value_or(document_.value_at(map));
  }

  void set_block(const std::string& block) {
    if (!document_.marks.contains("/measured")) {
      const bool ended = text_.empty() || text_.back() == '\n';
      return edits_.push_back({text_.size(), 0, (ended ? "" : "\n") + block});
    }
    const size_t begin = offset(document_.key_at("/measured"));
    // The block ends before the next line that begins in the first column; a brace there still belongs to it.
    size_t end = next_line(begin);
    while (end < text_.size() && (text_[end] == ' ' || text_[end] == '}')) end = next_line(end);
    edits_.push_back({begin, end - begin, block});
  }
  size_t next_line(size_t from) const {
    const size_t newline = text_.find('\n', from);
    return newline == std::string_view::npos ? text_.size() : newline + 1;
  }

  /// Every value but the budgets and the block must read as before, and the budgets as wanted.
  void check(const std::string& result, const std::map<std::string, int64_t>& budgets_ns) {
    std::vector<Problem> problems;
    Document after = parse_document(result, name_, {}, problems);
    if (!problems.empty()) return fail(problems.front().position, "after the edit: " + problems.front().text);
    for (const auto& [id, ns] : budgets_ns)
      if (after.raw(child(child("/nodes", id), "budget")) != budget_text(ns))
        return fail(after.value_at(child("/nodes", id)), "the budget could not be put in place");
    for (nlohmann::json* root : {&document_.root, &after.root}) {
      root->erase("measured");
      auto& nodes = (*root)["nodes"];
      for (const auto& [id, ns] : budgets_ns) {
        if (!nodes.contains(id)) continue;
        nodes[id].erase("budget");
        if (nodes[id].empty()) nodes.erase(id);
      }
    }
    if (document_.root != after.root) fail(document_.value_at(""), "the edit would change more than budgets");
  }

  std::string_view text_;
  std::string name_;
  Document document_;
  std::vector<Edit> edits_;
  std::optional<Problem> problem_;
};

}  // namespace

std::string budget_text(int64_t ns) {
  if (ns <= 999 * kUs) return fmt::format("{}us", (ns + kUs - 1) / kUs);
  int64_t step = 10 * kUs;
  int decimals = 2;
  for (int64_t limit = 10 * kMs; decimals > 0 && (ns + step - 1) / step * step >= limit; limit *= 10, step *= 10)
    --decimals;
  const int64_t rounded = (ns + step - 1) / step * step;
  std::string text = fmt::format("{}", rounded / kMs);
  if (decimals > 0) text += fmt::format(".{:0{}}", rounded % kMs / step, decimals);
  while (decimals > 0 && text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text + "ms";
}

tl::expected<std::string, Problem> with_budgets(std::string_view text, const std::string& name,
                                                const std::map<std::string, int64_t>& budgets_ns,
                                                const MeasuredSpec& measured) {
  return Editor(text, name).edited(budgets_ns, measured);
}

}  // namespace takt::graph
