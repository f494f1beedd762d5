// SPDX-License-Identifier: Apache-2.0
// Internal to graph/view: the sections of the page and what they share. A section is complete HTML with its heading.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt::view {

using Json = nlohmann::ordered_json;

// Readers that take any JSON: what is absent or of another kind is null, empty or nothing.
const Json& at(const Json& value, std::string_view key);
const Json& at(const Json& value, std::string_view key, std::string_view inner);
std::optional<double> number(const Json& value);
std::string words(const Json& value);  ///< a string; "" for anything else
/// The value with `format` (fmt, of a double); "–" if it is no number.
std::string figure(const Json& value, const char* format);
std::string count_text(const Json& value);  ///< a whole number, "–" if it is none

/// A table that scrolls sideways where the page is narrow.
class Table {
 public:
  struct Column {
    std::string title;
    bool is_number = true;
  };
  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}
  /// A heading over the next columns: {"lateness us", 4} spans four.
  void group(std::string title, size_t columns) { groups_.emplace_back(std::move(title), columns); }
  void begin_row() { body_ += "</tr>\n<tr>", next_ = 0; }
  /// `bad` marks a broken promise.
  void cell(std::string_view text, bool bad = false);
  std::string html() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::pair<std::string, size_t>> groups_;
  std::string body_;
  size_t next_ = 0;
};

std::string section(std::string_view title, const std::string& body);
std::string note(std::string_view text);
std::string not_recorded();
/// Colour of the i-th node in all charts of a page, as CSS.
std::string node_colour(size_t i);

const char* page_style();
std::string head_section(const Json& report, const graph::GraphSpec& graph);
std::string nodes_section(const Json& report);
std::string histograms_section(const Json& report);
std::string timeline_section(const Json& report, const graph::GraphSpec& graph);
std::string edges_section(const Json& report);
std::string chains_section(const Json& report, const graph::GraphSpec& graph);
std::string memory_section(const Json& report);
std::string cpu_section(const Json& report);
std::string images_section(const std::filesystem::path& output);

}  // namespace takt::view
