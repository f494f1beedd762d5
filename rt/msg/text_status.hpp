// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/text_status.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// Human-readable state. Capacity: count (characters).
struct TextStatus {
  static constexpr std::string_view type_name = "text_status";
  Array<char> text;
  void show(Viewer& to) const { to.text({text.data(), text.size}); }
  TAKT_FIELDS(TextStatus, (text, ""))
};

}  // namespace takt
