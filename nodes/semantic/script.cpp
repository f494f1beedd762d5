// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/script.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace takt::semantic {
namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr const char* kScriptForms =
    "; valid are \"TIME stop NODE\", \"TIME start NODE\" and \"TIME pace NODE N\", joined by `;`, with a TIME such as "
    "5s or 500ms";
constexpr const char* kRuleForms =
    "; valid are \"NODE when CONDITION else stop\" and \"NODE when CONDITION else pace N\", joined by `;`, with a "
    "CONDITION such as person within 4m, or crossing";

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> words;
  for (size_t at = 0; (at = text.find_first_not_of(separators, at)) != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(separators, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(kBlank) + 1 - first);
}

tl::unexpected<std::string> fault(std::string_view piece, const std::string& what, const char* forms) {
  return tl::make_unexpected("\"" + std::string(piece) + "\": " + what + forms);
}

/// A number that is not negative, with a unit or a part of it; at most 1e9 of the unit.
std::optional<double> parse_quantity(std::string_view word, std::string_view unit, std::string_view part,
                                     double parts) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value, std::chars_format::fixed);
  const std::string_view given = word.substr(static_cast<size_t>(end - word.data()));
  if (given == part) value *= parts;
  const bool valid = error == std::errc{} && (given == unit || given == part) && value >= 0 && value <= 1e9;
  return valid ? std::optional(value) : std::nullopt;
}

/// N of "pace N".
std::optional<uint8_t> parse_pace(std::string_view word, uint8_t least) {
  uint8_t every = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), every);
  const bool valid = error == std::errc{} && end == word.data() + word.size() && every >= least;
  return valid ? std::optional(every) : std::nullopt;
}

/// What is wrong with a node id; empty if nothing is. As in the graph, and short enough for a Request.
std::string id_fault(std::string_view id) {
  constexpr size_t kLongest = sizeof(Request::node) - 1;
  const auto lower = [](char c) { return c >= 'a' && c <= 'z'; };
  const bool valid = !id.empty() && lower(id[0]) && std::all_of(id.begin(), id.end(), [&](char c) {
    return lower(c) || (c >= '0' && c <= '9') || c == '_';
  });
  if (!valid)
    return "`" + std::string(id) + "` is no node id (lower-case letters, digits and _, beginning with a letter)";
  if (id.size() > kLongest)
    return "`" + std::string(id) + "` is longer than the " + std::to_string(kLongest) +
           " characters that a request holds";
  return "";
}

tl::expected<TimedRequest, std::string> parse_request(std::string_view piece) {
  const auto wrong = [&](const std::string& what) { return fault(piece, what, kScriptForms); };
  const std::vector<std::string_view> words = split(piece, kBlank);
  TimedRequest request;
  const auto time_s = parse_quantity(words[0], "s", "ms", 1e-3);
  if (!time_s) return wrong("`" + std::string(words[0]) + "` is no time");
  request.after_ns = std::llround(*time_s * 1e9);
  if (words.size() < 2) return wrong("nothing is asked for");
  if (words[1] == "stop") request.verb = Verb::stop;
  else if (words[1] == "start") request.verb = Verb::start;
  else if (words[1] == "pace") request.verb = Verb::pace;
  else return wrong("`" + std::string(words[1]) + "` is no request");
  const size_t wanted = request.verb == Verb::pace ? 4 : 3;
  if (words.size() != wanted)
    return wrong("has " + std::to_string(words.size()) + " words instead of " + std::to_string(wanted));
  if (const std::string id = id_fault(words[2]); !id.empty()) return wrong(id);
  request.node = words[2];
  if (request.verb == Verb::pace) {
    const auto every = parse_pace(words[3], 1);
    if (!every) return wrong("`" + std::string(words[3]) + "` is no N of 1..255");
    request.every = *every;
  }
  return request;
}

/// "stop" or "pace N", from word `at` on.
tl::expected<Rule, std::string> parse_otherwise(std::string_view piece, const std::vector<std::string_view>& words,
                                                size_t at, Rule rule) {
  const auto wrong = [&](const std::string& what) { return fault(piece, what, kRuleForms); };
  if (at + 1 >= words.size() || words[at] != "else") return wrong("lacks `else` and what is asked for then");
  const size_t left = words.size() - at - 1;
  if (words[at + 1] == "stop" && left == 1) {
    rule.otherwise.run = 0;
    return rule;
  }
  if (words[at + 1] != "pace" || left != 2) return wrong("what stands behind `else` is no request");
  const auto every = parse_pace(words[at + 2], 2);
  if (!every) return wrong("`" + std::string(words[at + 2]) + "` is no N of 2..255");
  rule.otherwise.every = *every;
  return rule;
}

tl::expected<Rule, std::string> parse_rule(std::string_view piece) {
  const auto wrong = [&](const std::string& what) { return fault(piece, what, kRuleForms); };
  const std::vector<std::string_view> words = split(piece, kBlank);
  if (const std::string id = id_fault(words[0]); !id.empty()) return wrong(id);
  Rule rule;
  words[0].copy(rule.otherwise.node, sizeof(Request::node) - 1);
  if (words.size() < 3 || words[1] != "when") return wrong("lacks `when` and a condition");
  if (words[2] == "crossing") return parse_otherwise(piece, words, 3, rule);
  if (words.size() < 5 || words[3] != "within") return wrong("`" + std::string(words[2]) + "` is no condition");
  const auto within_m = parse_quantity(words[4], "m", "cm", 1e-2);
  if (!within_m) return wrong("`" + std::string(words[4]) + "` is no length");
  rule.type = words[2];
  rule.within_m = *within_m;
  return parse_otherwise(piece, words, 5, rule);
}

/// What `parse` makes of each piece; the first error of one.
template <class Item>
tl::expected<std::vector<Item>, std::string> parse_pieces(std::string_view text,
                                                          tl::expected<Item, std::string> (*parse)(std::string_view)) {
  std::vector<Item> items;
  for (const std::string_view untrimmed : split(text, ";")) {
    const std::string_view piece = trimmed(untrimmed);
    if (piece.empty()) continue;
    auto item = parse(piece);
    if (!item) return tl::make_unexpected(item.error());
    items.push_back(std::move(*item));
  }
  return items;
}

}  // namespace

tl::expected<std::vector<TimedRequest>, std::string> parse_script(std::string_view text) {
  auto script = parse_pieces(text, parse_request);
  if (script)
    std::stable_sort(script->begin(), script->end(),
                     [](const TimedRequest& a, const TimedRequest& b) { return a.after_ns < b.after_ns; });
  return script;
}

tl::expected<std::vector<Rule>, std::string> parse_rules(std::string_view text) {
  return parse_pieces(text, parse_rule);
}

tl::expected<std::vector<std::string>, std::string> parse_node_list(std::string_view text) {
  std::vector<std::string> nodes;
  for (const std::string_view word : split(text, ", \t\r\n")) {
    if (const std::string wrong = id_fault(word); !wrong.empty())
      return tl::make_unexpected("\"" + std::string(text) + "\": " + wrong + "; write ids joined by commas");
    if (std::find(nodes.begin(), nodes.end(), word) == nodes.end()) nodes.emplace_back(word);
  }
  return nodes;
}

}  // namespace takt::semantic
