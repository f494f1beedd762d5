// SPDX-License-Identifier: Apache-2.0
#include "hal/ros2/scan_message.hpp"

#include <cmath>

#include "hal/ros2/cdr_reader.hpp"

namespace takt::ros2 {
namespace {

constexpr size_t kMostFrame = 128;  ///< characters
constexpr int64_t kSecond_ns = 1'000'000'000;

/// Every beam lies within a quarter of a step of where the rule has it.
bool same_angles(const ScanRule& rule, double first_rad, double step_rad) {
  const auto is_near = [&](double angle, double expected) { return std::abs(angle - expected) <= rule.step_rad / 4; };
  const double beams = rule.beams - 1;
  return is_near(first_rad, rule.first_angle_rad) &&
         is_near(first_rad + step_rad * beams, rule.first_angle_rad + rule.step_rad * beams);
}

}  // namespace

const char* read_scan(std::span<const std::byte> cdr, const ScanRule& rule, std::span<float> range_m,
                      int64_t& stamp_ns) {
  CdrReader reader(cdr);
  const auto seconds = reader.number<int32_t>();
  const auto nanoseconds = reader.number<uint32_t>();
  const std::string_view frame = reader.text(kMostFrame);
  const double first_rad = reader.number<float>();
  reader.number<float>();  // angle_max: follows from the others
  const double step_rad = reader.number<float>();
  reader.number<float>();  // time_increment
  reader.number<float>();  // scan_time
  const auto least_m = reader.number<float>(), most_m = reader.number<float>();
  const size_t beams = reader.count(rule.beams);
  reader.numbers<float>(beams, range_m);
  reader.numbers<float>(reader.count(rule.beams), std::span<float>());  // intensities
  if (!reader.at_end()) return "a scan is no LaserScan, or has more beams than `beams`";
  if (beams != rule.beams) return "a scan has fewer beams than `beams`";
  if (!same_angles(rule, first_rad, step_rad)) return "the beams of a scan are not where `fov` and `beams` have them";
  if (!rule.frame.empty() && frame != rule.frame) return "a scan is of another frame than `frame`";
  if (seconds < 0 || nanoseconds >= kSecond_ns) return "the stamp of a scan is no time";
  stamp_ns = seconds * kSecond_ns + nanoseconds;
  const double most = std::min<double>(most_m, rule.max_range_m);
  for (float& range : range_m)
    if (!(range > 0 && range >= least_m && range <= most)) range = 0;
  return nullptr;
}

}  // namespace takt::ros2
