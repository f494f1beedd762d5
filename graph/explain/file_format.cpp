// SPDX-License-Identifier: Apache-2.0
#include "graph/explain/file_format.hpp"

#include <fmt/format.h>

#include "rt/abi.hpp"

namespace takt::explain {

std::optional<std::string> later_format(const nlohmann::ordered_json& head, int known) {
  if (!head.is_object() || !head.contains("format")) return std::nullopt;
  const auto& format = head.at("format");
  if (!format.is_number_integer() || format <= known) return std::nullopt;
  const bool told = head.contains("commit") && head.at("commit").is_string();
  return fmt::format("is of format {}, and this is Takt {}, which reads format {}; use a later Takt{}", format.dump(),
                     version().number, known,
                     told ? fmt::format(" (commit {} wrote the file)", head.at("commit").get<std::string>()) : "");
}

}  // namespace takt::explain
