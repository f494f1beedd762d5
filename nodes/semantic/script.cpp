// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/script.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "rt/msg/messages.hpp"

namespace takt::semantic {
namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr const char* kForms =
    "; valid are \"TIME stop NODE\", \"TIME start NODE\" and \"TIME pace NODE N\", joined by `;`, with a TIME such as "
    "5s or 500ms";

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

tl::unexpected<std::string> fault(std::string_view piece, const std::string& what) {
  return tl::make_unexpected("\"" + std::string(piece) + "\": " + what + kForms);
}

std::optional<int64_t> parse_time_ns(std::string_view word) {
  constexpr double kLongest_s = 1e9;
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value, std::chars_format::fixed);
  const std::string_view unit = word.substr(static_cast<size_t>(end - word.data()));
  const double scale = unit == "s" ? 1 : unit == "ms" ? 1e-3 : 0;
  if (error != std::errc{} || scale == 0 || !(value >= 0) || value * scale > kLongest_s) return std::nullopt;
  return std::llround(value * scale * 1e9);
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

tl::expected<TimedRequest, std::string> parse_piece(std::string_view piece) {
  const std::vector<std::string_view> words = split(piece, kBlank);
  TimedRequest request;
  const auto time = parse_time_ns(words[0]);
  if (!time) return fault(piece, "`" + std::string(words[0]) + "` is no time");
  request.after_ns = *time;
  if (words.size() < 2) return fault(piece, "nothing is asked for");
  if (words[1] == "stop") request.verb = Verb::stop;
  else if (words[1] == "start") request.verb = Verb::start;
  else if (words[1] == "pace") request.verb = Verb::pace;
  else return fault(piece, "`" + std::string(words[1]) + "` is no request");
  const size_t wanted = request.verb == Verb::pace ? 4 : 3;
  if (words.size() != wanted)
    return fault(piece, "has " + std::to_string(words.size()) + " words instead of " + std::to_string(wanted));
  if (const std::string wrong = id_fault(words[2]); !wrong.empty()) return fault(piece, wrong);
  request.node = words[2];
  if (request.verb == Verb::pace) {
    const std::string_view n = words[3];
    const auto [end, error] = std::from_chars(n.data(), n.data() + n.size(), request.every);
    if (error != std::errc{} || end != n.data() + n.size() || request.every == 0)
      return fault(piece, "`" + std::string(n) + "` is no N of 1..255");
  }
  return request;
}

}  // namespace

tl::expected<std::vector<TimedRequest>, std::string> parse_script(std::string_view text) {
  std::vector<TimedRequest> script;
  for (const std::string_view untrimmed : split(text, ";")) {
    const std::string_view piece = trimmed(untrimmed);
    if (piece.empty()) continue;
    auto request = parse_piece(piece);
    if (!request) return tl::make_unexpected(request.error());
    script.push_back(std::move(*request));
  }
  std::stable_sort(script.begin(), script.end(),
                   [](const TimedRequest& a, const TimedRequest& b) { return a.after_ns < b.after_ns; });
  return script;
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
