// SPDX-License-Identifier: Apache-2.0
// Made messages of each kind of the semantic link, all different.
#pragma once
#include <algorithm>
#include <cstring>
#include <string>

#include "hal/semantic_link/messages.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"

namespace takt::test {

using Bytes = std::vector<uint8_t>;

inline std::span<const uint8_t> plain(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()};
}

template <size_t N>
void set_text(char (&to)[N], const std::string& text) {
  std::memset(to, 0, N);
  std::copy_n(text.begin(), std::min(text.size(), N - 1), to);
}
inline void set_text(Array<char>& to, const std::string& text) {
  to.resize(text.size());
  std::copy_n(text.begin(), to.size, to.data());
}

/// As semantic processing would say it: `count` objects, every second with two attributes.
inline void fill(ObjectReports& reports, uint32_t number, uint32_t count = 3) {
  reports.in_map = static_cast<uint8_t>(number % 2);
  reports.names.resize(count);
  reports.places.resize(count);
  reports.attributes.resize(0);
  for (uint32_t i = 0; i < count; ++i) {
    set_text(reports.names[i].name, "cup_" + std::to_string(number + i));
    set_text(reports.names[i].type, "cup");
    const auto x = static_cast<float>(number);
    const bool with = i % 2 == 0;
    reports.places[i] = {x, static_cast<float>(i), 0.5f, 0.1f, 0.9f, with ? 2.0f : 0.0f};
    for (int a = 0; with && a < 2; ++a) {
      ObjectAttribute attribute;
      set_text(attribute.name, "level_" + std::to_string(a));
      set_text(attribute.value, "full");
      reports.attributes.push_back(attribute);
    }
  }
}

inline void fill(LaserScan& scan, uint32_t number, uint32_t beams = 181) {
  scan.first_angle_rad = -1.5;
  scan.step_rad = 0.01;
  scan.max_range_m = 8;
  scan.sweep_s = 0.0133;
  scan.scan_number = number;
  scan.range_m.resize(beams);
  for (uint32_t i = 0; i < beams; ++i) scan.range_m[i] = static_cast<float>((number * 7 + i) % 80) / 10;
}

/// A placed message of that kind, which another number makes another one.
inline void fill(semantic_link::Kind kind, uint32_t number, void* message) {
  using semantic_link::Kind;
  const std::string text = "number " + std::to_string(number);
  switch (kind) {
    case Kind::objects: return fill(*static_cast<ObjectReports*>(message), number);
    case Kind::scan: return fill(*static_cast<LaserScan*>(message), number);
    case Kind::odometry: static_cast<Odometry*>(message)->x_m = number; return;
    case Kind::status: return set_text(static_cast<TextStatus*>(message)->text, text);
    case Kind::velocity: static_cast<VelocityCommand*>(message)->speed_m_s = number / 1000.0; return;
    case Kind::outcome: {
      auto& outcome = *static_cast<ActionOutcome*>(message);
      outcome.number = number;
      outcome.state = static_cast<uint8_t>(number % 5);
      return set_text(outcome.reason, text);
    }
    case Kind::action: {
      auto& action = *static_cast<ActionCommand*>(message);
      action.number = number;
      set_text(action.objects[1], "cup");
      return set_text(action.action, text);
    }
    case Kind::task: {
      auto& task = *static_cast<RobotTask*>(message);
      task.number = number;
      return set_text(task.text, text);
    }
    default: return;
  }
}

}  // namespace takt::test
