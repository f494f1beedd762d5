// SPDX-License-Identifier: Apache-2.0
// Scalars of the YAML subset, and the one variable that is expanded in them.
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <regex>

#include "graph/language/document.hpp"
#include "graph/language/words.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// -?digits, and nothing else.
bool is_integer(std::string_view s) {
  if (!s.empty() && s[0] == '-') s.remove_prefix(1);
  return !s.empty() && std::all_of(s.begin(), s.end(), is_digit);
}

/// -?digits[.digits][e[+-]digits] with a point or an exponent.
bool is_decimal(std::string_view s) {
  static const std::regex form("-?[0-9]+(\\.[0-9]+)?([eE][+-]?[0-9]+)?");
  return s.size() < 64 && std::regex_match(s.begin(), s.end(), form);
}

bool is_constant(const std::string& name) {
  static const std::regex form("[a-z][a-z0-9_]*");
  return name.size() < 64 && std::regex_match(name, form);
}

/// What some YAML reader takes for a number and another for text, or reads with another value.
std::string trap(const std::string& s) {
  static const std::regex octal_or_leading_zero("[-+]?0[0-9_]+(\\.[0-9]*)?"), other_base("[-+]?0[xXoObB][0-9a-fA-F_]+"),
      sexagesimal("[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\\.[0-9_]*)?"), underscores("[-+]?[0-9][0-9_]*_[0-9_]*"),
      bare_point("[-+]?(\\.[0-9]+|[0-9]+\\.)([eE][+-]?[0-9]+)?"), plus("\\+[0-9.]+"),
      not_finite("[-+]?\\.(inf|Inf|INF|nan|NaN|NAN)"), date("[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}");
  if (s.size() > 64) return "";
  const auto is = [&](const std::regex& form) { return std::regex_match(s, form); };
  const std::string either = "write " + s.substr(std::min(s.find_first_not_of("+-0_"), s.size() - 1)) +
                             " for the number or \"" + s + "\" for the text";
  if (is(octal_or_leading_zero)) return "has a leading zero, which some YAML readers take for octal; " + either;
  if (is(other_base)) return "is a number only for some YAML readers; write it in decimal";
  if (is(sexagesimal)) return "is a base-60 number for some YAML readers; put it in quotes if it is text";
  if (is(underscores)) return "is a number only for some YAML readers; write it without `_`";
  if (is(bare_point)) return "lacks a digit beside the point; write 0.5 or 5.0";
  if (is(plus)) return "has a plus sign, which some YAML readers take for text; leave it out";
  if (is(not_finite)) return "is not a finite number";
  if (is(date)) return "is a date for some YAML readers; put it in quotes if it is text";
  for (const char* word :
       {"yes", "Yes", "YES", "no", "No", "NO", "on", "On", "ON", "off", "Off", "OFF", "True", "TRUE", "False", "FALSE"})
    if (s == word)
      return "is a truth value for some YAML readers and text for others; write true or false, or \"" + s +
             "\" for the text";
  return "";
}

}  // namespace

tl::expected<json, std::string> resolve_scalar(const std::string& s) {
  if (s.empty() || s == "~" || s == "null" || s == "Null" || s == "NULL") return json();
  if (s == "true") return json(true);
  if (s == "false") return json(false);
  if (const std::string why = trap(s); !why.empty()) return tl::make_unexpected(ticked(s) + " " + why);
  if (is_integer(s)) {
    int64_t value = 0;
    if (std::from_chars(s.data(), s.data() + s.size(), value).ec != std::errc{})
      return tl::make_unexpected(ticked(s.substr(0, 40)) + " does not fit into 64 bits");
    return json(value);
  }
  if (is_decimal(s)) {
    double value = 0;
    if (std::from_chars(s.data(), s.data() + s.size(), value).ec != std::errc{})
      return tl::make_unexpected(ticked(s) + " is out of the range of a number");
    return json(value);
  }
  return json(s);
}

tl::expected<std::string, std::string> expand_variables(const std::string& text, const std::filesystem::path& directory,
                                                        Constants constants) {
  std::string result;
  for (size_t at = 0;;) {
    const size_t begin = text.find("${", at);
    result += text.substr(at, begin - at);
    if (begin == std::string::npos) return result;
    const size_t end = text.find('}', begin);
    if (end == std::string::npos) return tl::make_unexpected("has ${ without }");
    const std::string inside = text.substr(begin + 2, end - begin - 2);
    const size_t colon = inside.find(":-");
    const std::string name = inside.substr(0, colon);
    if (constants == Constants::later && colon == std::string::npos && is_constant(name)) {
      result += "${" + name + "}";
      at = end + 1;
      continue;
    }
    if (name != "TAKT_DATA")
      return tl::make_unexpected("names the variable " + ticked("${" + name + "}") +
                                 "; only ${TAKT_DATA} and ${TAKT_DATA:-path} are expanded");
    const char* value = std::getenv("TAKT_DATA");
    std::error_code ignored;
    if (value != nullptr && *value != '\0') {
      result += std::filesystem::absolute(value, ignored).lexically_normal().string();
    } else if (colon != std::string::npos) {
      result += std::filesystem::absolute(directory / inside.substr(colon + 2), ignored).lexically_normal().string();
    } else {
      return tl::make_unexpected(
          "needs TAKT_DATA, which is not set; set it to the folder of recordings (export TAKT_DATA=/path), or write "
          "${TAKT_DATA:-path} with a path relative to this file");
    }
    at = end + 1;
  }
}

}  // namespace takt::graph
