// SPDX-License-Identifier: Apache-2.0
#include "graph/view/html_parts.hpp"

#include <fmt/format.h>

#include <cmath>

#include "graph/view/markup.hpp"

namespace takt::view {

const Json& at(const Json& value, std::string_view key) {
  static const Json none;
  if (!value.is_object()) return none;
  const auto found = value.find(std::string(key));
  return found == value.end() ? none : *found;
}

const Json& at(const Json& value, std::string_view key, std::string_view inner) { return at(at(value, key), inner); }

std::optional<double> number(const Json& value) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
  return value.get<double>();
}

std::string words(const Json& value) { return value.is_string() ? value.get<std::string>() : std::string(); }

std::string figure(const Json& value, const char* format) {
  const auto read = number(value);
  return read ? fmt::format(fmt::runtime(format), *read) : "–";
}

std::string count_text(const Json& value) { return figure(value, "{:.0f}"); }

void Table::cell(std::string_view text, bool bad) {
  const bool is_number = columns_[std::min(next_++, columns_.size() - 1)].is_number;
  const char* kind = bad ? (is_number ? " class=\"n bad\"" : " class=\"bad\"") : (is_number ? " class=\"n\"" : "");
  body_ += fmt::format("<td{}>{}</td>", kind, escape(text));
}

std::string Table::html() const {
  std::string head;
  if (!groups_.empty()) {
    head += "<tr>";
    for (const auto& [title, columns] : groups_)
      head += fmt::format("<th colspan=\"{}\" class=\"group\">{}</th>", columns, escape(title));
    head += "</tr>\n";
  }
  head += "<tr>";
  for (const Column& column : columns_)
    head += fmt::format("<th{}>{}</th>", column.is_number ? " class=\"n\"" : "", escape(column.title));
  const std::string rows = body_.empty() ? "" : body_.substr(std::string_view("</tr>\n").size()) + "</tr>";
  return fmt::format("<div class=\"scroll\"><table>\n<thead>{}</tr></thead>\n<tbody>{}</tbody></table></div>\n", head,
                     rows);
}

std::string section(std::string_view title, const std::string& body) {
  return fmt::format("<section>\n<h2>{}</h2>\n{}</section>\n", escape(title), body);
}

std::string note(std::string_view text) { return fmt::format("<p class=\"note\">{}</p>\n", escape(text)); }

std::string not_recorded() { return "<p class=\"note\">not recorded</p>\n"; }

std::string node_colour(size_t i) {
  // Hues a golden angle apart: neighbours differ, however many there are.
  return fmt::format("hsl({:.0f},58%,{}%)", std::fmod(210.0 + 137.508 * static_cast<double>(i), 360.0),
                     i % 2 ? 42 : 52);
}

}  // namespace takt::view
