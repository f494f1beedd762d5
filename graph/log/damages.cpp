// SPDX-License-Identifier: Apache-2.0
#include "graph/log/damages.hpp"

#include <fmt/format.h>

namespace takt::log {

std::string damages_text(const std::filesystem::path& file, const record::LogFile& log) {
  const auto& damages = log.damages();
  if (damages.empty()) return "";
  return fmt::format("{} is not whole: {}{}", file.string(), damages.front(),
                     damages.size() == 1 ? "" : fmt::format(" (and {} more)", damages.size() - 1));
}

}  // namespace takt::log
