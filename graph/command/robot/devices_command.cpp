// SPDX-License-Identifier: Apache-2.0
#include "graph/command/robot/devices_command.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/run/run.hpp"
#include "hal/discovery/discovery.hpp"
#include "hal/settings/json.hpp"

namespace takt::command {

int list_devices(bool json, const std::filesystem::path& root) {
  const auto all = discovery::discover(root);
  if (json) {
    auto list = nlohmann::ordered_json::array();
    for (const auto& found : all)
      list.push_back({{"where", found.where}, {"description", found.description}, {"line", found.line}});
    fmt::print("{}\n", list.dump(2));
    return kOk;
  }
  if (all.empty()) fmt::print("nothing that a driver of Takt fits is plugged in\n");
  size_t where = 0, description = 0;
  for (const auto& found : all) {
    where = std::max(where, found.where.size());
    description = std::max(description, found.description.size());
  }
  for (const auto& found : all)
    fmt::print("{:{}}  {:{}}  {}\n", found.where, where, found.description, description, found.line);
  return kOk;
}

}  // namespace takt::command
