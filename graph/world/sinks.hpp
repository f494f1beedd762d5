// SPDX-License-Identifier: Apache-2.0
// What a message that shows itself (shown.hpp, ros_shown.hpp) is made into.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "graph/world/encoder.hpp"
#include "graph/world/schema.hpp"

namespace takt::world {

/// Makes forms of what is wanted.
struct FormSink {
  const Wanted& wanted;
  std::vector<Form> forms = {};
  bool wants(const std::string& topic, std::string_view) const { return !wanted || wanted(topic); }
  template <Schema S>
  void take(const std::string& topic, const S& value) {
    forms.push_back({topic, full_name(S::schema_name), encoded(value)});
  }
};

/// Notes what there is.
struct OutlineSink {
  std::vector<Outline> outlines = {};
  bool wants(const std::string& topic, std::string_view schema) {
    outlines.push_back({topic, full_name(schema)});
    return false;
  }
  template <Schema S>
  void take(const std::string&, const S&) {}
};

}  // namespace takt::world
