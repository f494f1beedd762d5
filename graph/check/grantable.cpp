// SPDX-License-Identifier: Apache-2.0
#include "graph/check/grantable.hpp"

#include <fmt/format.h>

namespace takt::graph {

using Json = nlohmann::ordered_json;

std::string grantable_text(const std::optional<DeadlineBandwidth>& found) {
  if (!found) return "grantable: not known, SCHED_DEADLINE is refused to this user or on these CPUs\n";
  std::string text = fmt::format("grantable: {:.3f} of {:.3f} cores free now", found->free, found->limit);
  if (!found->holders.empty()) text += "; held by " + to_text(found->holders);
  if (found->lost() > 0)
    text += fmt::format("; {:.3f} lost, no living thread holds them: {}", found->lost(), recount_command());
  return text + "\n";
}

Json grantable_json(const std::optional<DeadlineBandwidth>& found) {
  if (!found) return nullptr;
  Json json{{"free", found->free}, {"of", found->limit}, {"lost", found->lost()}, {"held", Json::array()}};
  for (const DeadlineHolder& holder : found->holders)
    json["held"].push_back(
        {{"process", holder.name}, {"pid", holder.process}, {"threads", holder.threads}, {"cores", holder.cores}});
  return json;
}

}  // namespace takt::graph
