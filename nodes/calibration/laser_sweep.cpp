// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/laser_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string_view>

#include "rt/file/input_file.hpp"
#include "rt/file/output_file.hpp"

namespace takt::calibration {
namespace {

using laser_fusion::kPitch, laser_fusion::kRoll, laser_fusion::kYaw;

constexpr double kDegree = std::numbers::pi / 180;
constexpr size_t kLeastOnObject = 100;

/// Words of a line, one after the other.
class Words {
 public:
  explicit Words(std::string_view line) : rest_(line.substr(0, line.find('#'))) {}

  /// Empty at the end.
  std::string_view next() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r"), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r"));
    rest_.remove_prefix(word.size());
    return word;
  }
  double number(const char* what) { return number(next(), what); }
  static double number(std::string_view word, const char* what) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value))
      throw std::invalid_argument(fmt::format("\"{}\" must be {}, a number", word, what));
    return value;
  }
  void end() {
    if (const std::string_view word = next(); !word.empty())
      throw std::invalid_argument(fmt::format("\"{}\" is one word too many", word));
  }

 private:
  std::string_view rest_;
};

class Reader {
 public:
  void read(std::string_view line) {
    Words words(line);
    const std::string_view key = words.next();
    if (key.empty()) return;
    if (key == "object") object(words);
    else if (key == "scanner") scanner(words);
    else if (key == "beams") beams_ = {words.number("the first angle") * kDegree, words.number("the step") * kDegree};
    else if (key == "scan") return scan(words);  // as many words as there are
    else throw std::invalid_argument(fmt::format("\"{}\" must be object, scanner, beams or scan", key));
    words.end();
  }
  LaserRecording take() { return std::move(recording_); }

 private:
  void object(Words& words) {
    recording_.object_height_m = words.number("the object's height");
    if (!(recording_.object_height_m > 0)) throw std::invalid_argument("the object's height must be above 0 m");
  }
  void scanner(Words& words) {
    LaserSweep sweep;
    sweep.name = words.next();
    if (sweep.name.empty()) throw std::invalid_argument("`scanner` wants a name, then x y z (m) yaw pitch roll (deg)");
    for (double& p : sweep.mount) p = words.number("one of x y z (m) yaw pitch roll (deg)");
    for (const auto angle : {kYaw, kPitch, kRoll}) sweep.mount[angle] *= kDegree;
    recording_.sweeps.push_back(std::move(sweep));
  }
  void scan(Words& words) {
    if (recording_.sweeps.empty()) throw std::invalid_argument("`scan` comes before any `scanner`");
    if (beams_.step_rad == 0) throw std::invalid_argument("`scan` comes before `beams`, or their step is 0");
    LaserReturn r;
    r.heading_rad = words.number("the heading") * kDegree;
    std::string_view word;
    for (int beam = 0; !(word = words.next()).empty(); ++beam) {
      r.angle_rad = beams_.first_rad + beam * beams_.step_rad;
      r.on_object = word.back() == '*';
      if (r.on_object) word.remove_suffix(1);
      r.range_m = Words::number(word, "a range");
      if (r.range_m > 0) recording_.sweeps.back().returns.push_back(r);
    }
  }

  LaserRecording recording_;
  BeamAngles beams_;
};

void check(const LaserRecording& recording, const std::string& file) {
  if (recording.object_height_m == 0) throw std::invalid_argument(file + ": has no line \"object HEIGHT\"");
  if (recording.sweeps.empty()) throw std::invalid_argument(file + ": has no line \"scanner ...\"");
  for (const LaserSweep& sweep : recording.sweeps) {
    const auto on_object = static_cast<size_t>(
        std::count_if(sweep.returns.begin(), sweep.returns.end(), [](const LaserReturn& r) { return r.on_object; }));
    if (on_object < kLeastOnObject)
      throw std::invalid_argument(fmt::format("{}: scanner {} has {} returns on the object, at least {} must be marked",
                                              file, sweep.name, on_object, kLeastOnObject));
    if (sweep.mount[kRoll] == 0)
      throw std::invalid_argument(fmt::format(
          "{}: scanner {} has a roll of 0: without a tilt it sees no heights, and left and right cannot be told apart",
          file, sweep.name));
  }
}

}  // namespace

Eigen::Vector3d in_scanner(const LaserReturn& r) {
  return {-r.range_m * std::sin(r.angle_rad), r.range_m * std::cos(r.angle_rad), 0};
}

Eigen::Vector3d in_room(const LaserReturn& r, const Rigid& mount) {
  return Eigen::AngleAxisd(r.heading_rad, Eigen::Vector3d::UnitZ()) * (mount * in_scanner(r));
}

std::vector<Point> in_room(const LaserSweep& sweep, const Rigid& mount, size_t step) {
  std::vector<Point> points;
  for (size_t i = 0; i < sweep.returns.size(); i += step) {
    const Eigen::Vector3f p = in_room(sweep.returns[i], mount).cast<float>();
    points.push_back({p.x(), p.y(), p.z()});
  }
  return points;
}

LaserRecording read_laser_recording(const std::filesystem::path& file) {
  require_readable<std::invalid_argument>(file);
  std::ifstream in(file);
  Reader reader;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) try {
      reader.read(line);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}:{}: {}", file.string(), number, error.what()));
    }
  LaserRecording recording = reader.take();
  check(recording, file.string());
  return recording;
}

void write_laser_recording(const std::filesystem::path& file, const LaserRecording& recording,
                           const BeamAngles& beams) {
  std::ostringstream out;
  out << fmt::format("object {}\nbeams {} {}\n", recording.object_height_m, beams.first_rad / kDegree,
                     beams.step_rad / kDegree);
  for (const LaserSweep& sweep : recording.sweeps) {
    const PoseParameters& m = sweep.mount;
    out << fmt::format("scanner {} {} {} {} {} {} {}", sweep.name, m[0], m[1], m[2], m[kYaw] / kDegree,
                       m[kPitch] / kDegree, m[kRoll] / kDegree);
    double heading_rad = std::numeric_limits<double>::quiet_NaN();
    long beam = 0;  // the next one of the scan
    for (const LaserReturn& r : sweep.returns) {
      if (r.heading_rad != heading_rad) {
        heading_rad = r.heading_rad;
        beam = 0;
        out << fmt::format("\nscan {}", heading_rad / kDegree);
      }
      for (const long at = std::lround((r.angle_rad - beams.first_rad) / beams.step_rad); beam < at; ++beam)
        out << " 0";
      out << fmt::format(" {:.4f}{}", r.range_m, r.on_object ? "*" : "");
      ++beam;
    }
    out << "\n";
  }
  require_written(write_file(file, out.str()));
}

}  // namespace takt::calibration
