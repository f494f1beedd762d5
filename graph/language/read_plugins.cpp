// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "graph/language/document.hpp"

namespace takt::graph {
namespace {

/// Those of the file, then those of what it includes; each file once, whatever the loader says of a second time.
void collect(const std::filesystem::path& file, std::set<std::filesystem::path>& seen, std::vector<PluginName>& names) {
  std::error_code ignored;
  if (!seen.insert(std::filesystem::weakly_canonical(file, ignored)).second) return;
  std::vector<Problem> told_later;
  const Document document = read_document(file, {file.string(), 0, 0}, told_later, Constants::later);
  const auto each_text = [&](const char* key, const auto& take) {
    if (!document.root.is_object() || !document.root.contains(key) || !document.root.at(key).is_array()) return;
    const nlohmann::json& list = document.root.at(key);
    for (size_t i = 0; i < list.size(); ++i)
      if (list[i].is_string()) take(list[i].template get<std::string>(), child(child("", key), i));
  };
  const auto directory = std::filesystem::absolute(file, ignored).parent_path();
  each_text("plugins", [&](const std::string& name, const std::string& pointer) {
    names.push_back({name, directory, document.value_at(pointer)});
  });
  each_text("include",
            [&](const std::string& name, const std::string&) { collect(included_file(document, name), seen, names); });
}

}  // namespace

std::vector<PluginName> plugins_of(const std::filesystem::path& file) {
  std::set<std::filesystem::path> seen;
  std::vector<PluginName> names;
  collect(file, seen, names);
  return names;
}

}  // namespace takt::graph
