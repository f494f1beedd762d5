// SPDX-License-Identifier: Apache-2.0
#include "graph/language/document.hpp"

namespace takt::graph {

std::vector<PluginName> plugins_of(const std::filesystem::path& file) {
  std::vector<Problem> told_later;
  const Document document = read_document(file, {file.string(), 0, 0}, told_later);
  std::vector<PluginName> names;
  if (!document.root.is_object() || !document.root.contains("plugins")) return names;
  const nlohmann::json& list = document.root.at("plugins");
  std::error_code ignored;
  const auto directory = std::filesystem::absolute(file, ignored).parent_path();
  for (size_t i = 0; i < list.size(); ++i)
    if (list.is_array() && list[i].is_string())
      names.push_back({list[i].get<std::string>(), directory, document.value_at(child("/plugins", i))});
  return names;
}

}  // namespace takt::graph
