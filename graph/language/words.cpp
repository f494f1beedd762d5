// SPDX-License-Identifier: Apache-2.0
#include "graph/language/words.hpp"

#include <algorithm>
#include <cctype>

namespace takt::graph {
namespace {
char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }
// Words of a graph are short; a longer one is no slip of the pen, and the table below stays small.
constexpr size_t kLongest = 64;
constexpr size_t kListed = 40;
}  // namespace

size_t edit_distance(std::string_view a, std::string_view b) {
  // Optimal string alignment (Damerau 1964, restricted): three rows of the table are enough.
  std::vector<size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) above[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replace = above[j - 1] + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, replace});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]))
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, above);
    std::swap(above, row);
  }
  return above[b.size()];
}

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.empty() || word.size() > kLongest) return "";
  std::string best;
  size_t best_distance = (word.size() + 2) / 3 + 1;  // one edit in three letters
  for (const auto& candidate : candidates) {
    if (candidate.size() > kLongest || candidate == word) continue;
    const size_t distance = edit_distance(word, candidate);
    if (distance < best_distance && distance < candidate.size()) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string join_words(const std::vector<std::string>& words, std::string_view separator) {
  std::string text;
  for (size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += separator;
    if (i == kListed) return text + "... (" + std::to_string(words.size() - kListed) + " more)";
    text += words[i];
  }
  return text;
}

std::string alternatives(std::string_view word, std::vector<std::string> candidates, std::string_view what) {
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  if (candidates.empty()) return "; " + std::string(what) + ": (none)";
  const std::string near = nearest(word, candidates);
  return (near.empty() ? "; " : "; did you mean " + ticked(near) + "? ") + std::string(what) + ": " +
         join_words(candidates);
}

std::string ticked(std::string_view word) { return "`" + std::string(word) + "`"; }

}  // namespace takt::graph
