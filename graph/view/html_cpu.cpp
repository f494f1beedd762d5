// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "graph/view/html_parts.hpp"
#include "graph/view/markup.hpp"

namespace takt::view {
namespace {

constexpr const char* kParts[] = {"nodes", "devices", "simulator", "runtime"};

}  // namespace

std::string cpu_section(const Json& report) {
  const Json& cpu = at(report, "cpu");
  const auto used = number(at(cpu, "utilisation"));
  if (!used) return section("CPU", not_recorded());
  // The bar is as long as the machine has cores.
  const double whole = std::max({number(at(report, "machine", "cores")).value_or(1), *used, 1e-9});
  std::string bar, legend;
  for (size_t i = 0; i < std::size(kParts); ++i) {
    const auto share = number(at(at(cpu, "by"), kParts[i]));
    bar += fmt::format("<i style=\"width:{:.2f}%;background:{}\"></i>", 100 * std::max(0.0, share.value_or(0)) / whole,
                       node_colour(i));
    legend += fmt::format("<i class=\"swatch\" style=\"background:{}\"></i>{} {}", node_colour(i), kParts[i],
                          share ? fmt::format("{:.3f}", *share) : "not recorded");
  }
  return section("CPU", fmt::format("<p>{:.2f} cores of {:g}</p>\n<div class=\"stack\">{}</div>\n<p>{}</p>\n", *used,
                                    whole, bar, legend));
}

}  // namespace takt::view
