// SPDX-License-Identifier: Apache-2.0
#include "nodes/cuda/card_check.hpp"

#include <string>

#include "nodes/cuda/card.hpp"

namespace takt::cuda {

machine::Finding check_card() {
  machine::Finding f{"accelerators", "cuda", machine::Need::advice, machine::Status::unknown, "", ""};
  f.meaning = "nodes with `accelerator: auto` stay on the CPU, `cuda` is refused";
  const auto card = find_card(0);
  if (card) {
    f.status = machine::Status::ok;
    f.found = card->name;
    f.meaning = "nodes whose parameter `accelerator` asks for it may use it";
    return f;
  }
  constexpr std::string_view kFix = "\n  fix: ";
  const size_t fix = card.error().find(kFix);
  f.found = card.error().substr(0, fix);
  if (fix != std::string::npos) f.fixes = {{"here", card.error().substr(fix + kFix.size())}};
  return f;
}

}  // namespace takt::cuda
