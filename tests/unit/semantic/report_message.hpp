// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>

#include <initializer_list>
#include <string_view>
#include <utility>

#include "nodes/semantic/reports.hpp"
#include "rt/msg/ace/object_reports.hpp"

namespace takt::test {

/// Adds an object to a message; score 0.9.
inline void add_report(ObjectReports& message, std::string_view name, std::string_view type, float x_m, float y_m,
                       std::initializer_list<std::pair<std::string_view, std::string_view>> attributes = {}) {
  ObjectName named{};
  REQUIRE(semantic::set_text(name, named.name));
  REQUIRE(semantic::set_text(type, named.type));
  REQUIRE(message.names.push_back(named));
  message.places.push_back({x_m, y_m, 0, 0, 0.9F, static_cast<float>(attributes.size())});
  for (const auto& [key, value] : attributes) {
    ObjectAttribute said{};
    REQUIRE(semantic::set_text(key, said.name));
    REQUIRE(semantic::set_text(value, said.value));
    REQUIRE(message.attributes.push_back(said));
  }
}

}  // namespace takt::test
