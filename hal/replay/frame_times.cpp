// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/frame_times.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>

namespace takt::replay {
namespace {

using Seconds = long double;  // its 64 bits hold ns since 1970

struct Unit {
  const char* name;
  Seconds seconds;
};
constexpr std::array<Unit, 4> kUnits{{{"s", 1}, {"ms", 1e-3L}, {"us", 1e-6L}, {"ns", 1e-9L}}};
constexpr Seconds kClosest_s = 0.004L, kFarthest_s = 2;

std::optional<Seconds> parse_date(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, used = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d%*1[ T]%2d:%2d:%n", &year, &month, &day, &hour, &minute, &used) != 5 ||
      used == 0)
    return std::nullopt;
  double second = 0;
  const char* const end = text.data() + text.size();
  if (std::from_chars(text.data() + used, end, second).ec != std::errc{}) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year{year}, std::chrono::month{static_cast<unsigned>(month)},
                                         std::chrono::day{static_cast<unsigned>(day)}};
  if (!date.ok() || hour > 23 || minute > 59 || second < 0 || second > 61) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return static_cast<Seconds>(days) * 86'400 + hour * 3600 + minute * 60 + static_cast<Seconds>(second);
}

std::optional<Seconds> parse_number(const std::string& text) {
  const std::string word = text.substr(0, text.find_first_of(", \t;"));
  Seconds value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

struct Raw {
  std::vector<Seconds> values;  ///< since the first, in the unit of the file
  bool dates = false;
};

tl::expected<Raw, DeviceError> read_lines(const std::string& id, const std::filesystem::path& file) {
  std::ifstream in(file);
  Raw raw;
  Seconds first = 0;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    line.erase(0, line.find_first_not_of(" \t"));
    if (line.empty() || line[0] == '#') continue;
    const auto wrong = [&](const std::string& what, const char* fix) {
      return device_error(id, file.string() + ":" + std::to_string(number) + ": " + what, fix);
    };
    const auto date = parse_date(line), value = date ? date : parse_number(line);
    if (!value) return wrong("`" + line + "` is no number and no date", "one time a line, in s, ms, us or ns");
    if (raw.values.empty()) first = *value, raw.dates = date.has_value();
    if (raw.dates != date.has_value()) return wrong("dates and numbers are mixed", "use one of both");
    if (!raw.values.empty() && *value - first <= raw.values.back())
      return wrong("time does not rise", "sort the recording");
    raw.values.push_back(*value - first);
  }
  return raw;
}

/// Median of the steps.
Seconds typical_step(const std::vector<Seconds>& values) {
  std::vector<Seconds> steps;
  for (size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

tl::expected<FrameTimes, DeviceError> read_frame_times(const std::string& id, const std::filesystem::path& file,
                                                       size_t frames) {
  const auto raw = read_lines(id, file);
  if (!raw) return tl::unexpected(raw.error());
  if (raw->values.size() != frames)
    return device_error(
        id,
        file.string() + ": " + std::to_string(raw->values.size()) + " times for " + std::to_string(frames) + " frames",
        "one line per frame, or delete the file and give `rate`");
  FrameTimes times;
  Unit unit = kUnits[0];
  if (const Seconds step = typical_step(raw->values); !raw->dates && frames > 1) {
    const auto fits = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) {
      return step * u.seconds >= kClosest_s && step * u.seconds <= kFarthest_s;
    });
    char apart[32];
    std::snprintf(apart, sizeof apart, "%.6Lg", step);
    if (fits == kUnits.end())
      times.note =
          file.string() + ": frames are " + apart + " apart, which is unusual in s, ms, us and ns; read as seconds";
    else if (fits != kUnits.begin())
      times.note = file.string() + ": frames are " + apart + " apart; the " + std::to_string(frames) +
                   " times are read as " + fits->name;
    if (fits != kUnits.end()) unit = *fits;
  }
  for (const Seconds value : raw->values) {
    times.stamp_ns.push_back(std::llroundl(value * unit.seconds * 1e9L));
    if (times.stamp_ns.size() > 1 && times.stamp_ns.back() <= times.stamp_ns[times.stamp_ns.size() - 2])
      return device_error(id, file.string() + ": two frames are less than 1 ns apart", "give distinct times");
  }
  return times;
}

}  // namespace takt::replay
