// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/carmen_log.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>

#include "hal/replay/late_stamps.hpp"

namespace takt::replay {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLmsRange_m = 80.0;     // what an LMS 200 can tell in its cm mode (D-1.7)
constexpr double kLatestStamp_s = 4e9;   // int64 ns hold twice as much
constexpr double kLargestDelay_s = 5.0;  // of a late stamp; more is a clock that was set, or two logs in one file
constexpr size_t kTrailer = 3;           // ipc_time host logger_time
constexpr uint32_t kFewestBeams = 2, kMostBeams = 4096;

bool parse_number(std::string_view word, double& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size() && std::isfinite(value);
}

void split(std::string_view line, std::vector<std::string_view>& words) {
  constexpr std::string_view kBlank = " \t\r";
  words.clear();
  for (size_t from = line.find_first_not_of(kBlank); from != std::string_view::npos;) {
    const size_t to = std::min(line.find_first_of(kBlank, from), line.size());
    words.push_back(line.substr(from, to - from));
    from = line.find_first_not_of(kBlank, to);
  }
}

/// Beams of a sweep in a line that tells only their number: 180 degrees, from the right. 181 beams reach the left end,
/// of 180 the last one is left out.
double flaser_step(uint32_t beams) { return kPi / static_cast<double>(beams % 2 == 1 ? beams - 1 : beams); }

class Parser {
 public:
  Parser(std::string id, std::filesystem::path file) : id_(std::move(id)), file_(std::move(file)) {}

  tl::expected<CarmenLog, DeviceError> parse(uint64_t largest_bytes) {
    if (!readable(largest_bytes)) return tl::unexpected(*error_);
    std::ifstream in(file_, std::ios::binary);
    for (std::string text; std::getline(in, text);) {
      ++line_;
      split(text, words_);
      if (words_.empty() || words_[0][0] == '#') continue;
      if (!in.eof()) {
        if (!message()) return tl::unexpected(*error_);
      } else if (!last_message()) {
        return tl::unexpected(*error_);
      }
    }
    if (!settle_odometry(false)) return tl::unexpected(*error_);
    if (log_.odometry.empty()) use_scan_poses();
    choose_times();
    if (!set_times()) return tl::unexpected(*error_);
    tell_rest();
    return std::move(log_);
  }

 private:
  enum class Kind : uint8_t { odometry, scan };
  struct Entry {
    Kind kind;
    int line;
    double time_s;
    double sent_s;  ///< by the clock of who sent the message; NaN: not stated
  };
  /// An ODOM line whose meaning the next line decides.
  struct Pending {
    PlanarPose pose;
    int line;
    double time_s;
    bool timed;  ///< time_s is a time
    double sent_s;
  };

  /// Of a last line without its end: its time is a part of one.
  bool cut_off() const {
    double time_s = 0;
    return !entries_.empty() && parse_number(words_.back(), time_s) && entries_.back().time_s > time_s;
  }
  /// In a line without its end: what cannot be read is what a logger that was killed had not written yet.
  bool last_message() {
    if (!settle_odometry(words_[0] == "NEFF")) return false;
    if (!cut_off() && message() && (!pending_ || pending_->timed)) return true;
    error_.reset();
    pending_.reset();
    log_.range_m.resize(log_.scans.size() * log_.beams);
    if (scan_poses_.size() > log_.scans.size()) scan_poses_.pop_back();
    note("line " + std::to_string(line_) + " is cut off and left out");
    return true;
  }
  void note(const std::string& what) { log_.left_out.push_back(file_.string() + ": " + what); }
  double sent_s() const {
    double time_s = 0;
    return words_.size() >= kTrailer && parse_number(words_[words_.size() - kTrailer], time_s) && is_time(time_s)
               ? time_s
               : std::nan("");
  }

  bool fail(int line, const std::string& what, std::string fix) {
    const std::string where = line > 0 ? file_.string() + ":" + std::to_string(line) : file_.string();
    error_ = DeviceError{id_, where + ": " + what, std::move(fix), true};
    return false;
  }
  bool fail(const std::string& what) { return fail(line_, what, "delete the line, or record the log again"); }

  bool readable(uint64_t largest_bytes) {
    std::error_code failed;
    const uint64_t bytes = std::filesystem::file_size(file_, failed);
    std::ifstream in(file_, std::ios::binary);
    if (failed || !in) return fail(0, "cannot be opened", "correct `log`; a ${TAKT_DATA} in it is expanded");
    if (bytes > largest_bytes)
      return fail(0, "has " + std::to_string(bytes) + " bytes, at most " + std::to_string(largest_bytes) + " are read",
                  "cut the log into parts");
    if (in.get() == 0x1f && in.get() == 0x8b) return fail(0, "is compressed", "unpack it with gunzip");
    return true;
  }

  bool number(size_t word, double& value) {
    if (parse_number(words_[word], value)) return true;
    return fail("word " + std::to_string(word + 1) + " of " + std::string(words_[0]) + " is `" +
                std::string(words_[word]) + "`, no finite number");
  }
  /// As number(); 0 for inf and NaN, which some writers have for no return.
  bool range(size_t word, double& value) {
    const std::string_view text = words_[word];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || std::isfinite(value)) return number(word, value);
    value = 0;
    ++no_numbers_;
    return true;
  }
  bool count(size_t word, uint32_t low, uint32_t high, uint32_t& value) {
    double parsed = 0;
    if (!number(word, parsed)) return false;
    if (parsed != std::floor(parsed) || parsed < low || parsed > high)
      return fail("word " + std::to_string(word + 1) + " of " + std::string(words_[0]) + " is " +
                  std::string(words_[word]) + ", not a count from " + std::to_string(low) + " to " +
                  std::to_string(high));
    value = static_cast<uint32_t>(parsed);
    return true;
  }
  bool has_words(size_t wanted) {
    if (words_.size() == wanted) return true;
    return fail(std::string(words_[0]) + " has " + std::to_string(words_.size()) + " words, needs " +
                std::to_string(wanted));
  }
  bool pose(size_t first_word, PlanarPose& pose) {
    return number(first_word, pose.x_m) && number(first_word + 1, pose.y_m) && number(first_word + 2, pose.theta_rad);
  }
  static bool is_time(double seconds) { return seconds >= 0 && seconds <= kLatestStamp_s; }

  bool message() {
    const std::string_view name = words_[0];
    if (!settle_odometry(name == "NEFF")) return false;
    const bool ok = name == "ODOM"          ? odometry()
                    : name == "FLASER"      ? flaser()
                    : name == "RAWLASER1"   ? rawlaser(false)
                    : name == "ROBOTLASER1" ? rawlaser(true)
                    : name == "PARAM"       ? parameter()
                                            : pass_over();
    after_scan_ = name == "FLASER" && name == scan_message_;
    return ok;
  }

  bool pass_over() {
    ++passed_over_[std::string(words_[0])];
    return true;
  }

  bool odometry() {
    Pending line{{}, line_, 0, false, sent_s()};
    if (!has_words(7 + kTrailer) || !pose(1, line.pose)) return false;
    line.timed = parse_number(words_.back(), line.time_s) && is_time(line.time_s);
    pending_ = line;
    pending_repeats_scan_ = after_scan_ && line.pose.x_m == log_.scans.back().logged.x_m &&
                            line.pose.y_m == log_.scans.back().logged.y_m &&
                            line.pose.theta_rad == log_.scans.back().logged.theta_rad;
    return true;
  }

  /// Takes the pending ODOM line, if any, for odometry or, before a line NEFF, for the correction of the scan before.
  bool settle_odometry(bool before_neff) {
    if (!pending_) return true;
    const Pending line = *pending_;
    pending_.reset();
    if (before_neff && pending_repeats_scan_) {
      log_.scans.back().corrected = true;
      logged_in_odometry_ = compose(odometry_, between(line.pose, {}));
      return true;
    }
    if (!line.timed) return fail(line.line, "ODOM ends with no time", "delete the line, or record the log again");
    odometry_ = compose(logged_in_odometry_, line.pose);
    log_.odometry.push_back({0, odometry_});
    entries_.push_back({Kind::odometry, line.line, line.time_s, line.sent_s});
    return true;
  }

  bool flaser() {
    if (scan_message_.empty()) scan_message_ = words_[0];
    if (scan_message_ != words_[0]) return pass_over();
    uint32_t beams = 0;
    CarmenScan scan;
    if (words_.size() < 2) return fail("FLASER has no count of ranges");
    if (!count(1, kFewestBeams, kMostBeams, beams) || !has_words(2 + beams + 6 + kTrailer)) return false;
    return geometry(beams, -kPi / 2, flaser_step(beams), kLmsRange_m) && pose(2 + beams, scan.logged) && add(scan, 2);
  }

  /// RAWLASER1, or ROBOTLASER1, which has poses and limits behind it.
  bool rawlaser(bool of_robot) {
    constexpr size_t kPosesAndLimits = 11;
    if (scan_message_.empty()) scan_message_ = words_[0];
    if (scan_message_ != words_[0]) return pass_over();
    const std::string name(words_[0]);
    if (words_.size() < 9) return fail(name + " has no count of ranges");
    uint32_t beams = 0, remissions = 0;
    double first = 0, step = 0, range = 0;
    if (!number(2, first) || !number(4, step) || !number(5, range) || !count(8, kFewestBeams, kMostBeams, beams))
      return false;
    if (step <= 0 || range <= 0) return fail("angular step and largest range of " + name + " must be positive");
    if (words_.size() <= 9 + beams) return fail(name + " has fewer than " + std::to_string(beams) + " ranges");
    if (!count(9 + beams, 0, kMostBeams, remissions)) return false;
    const size_t poses = 10 + beams + remissions;
    CarmenScan scan;
    if (!has_words(poses + (of_robot ? kPosesAndLimits : 0) + kTrailer) || !geometry(beams, first, step, range))
      return false;
    if (of_robot) {
      PlanarPose robot;
      if (!pose(poses, scan.logged) || !pose(poses + 3, robot)) return false;
      if (log_.scans.empty() && log_.laser_ahead_m == 0) log_.laser_ahead_m = between(robot, scan.logged).x_m;
      scan_poses_.push_back(robot);
    }
    return add(scan, 9);
  }

  /// The odometry of a log without lines ODOM.
  void use_scan_poses() {
    if (scan_poses_.empty() || scan_poses_.size() != log_.scans.size()) return;
    std::vector<Entry> both;
    for (size_t i = 0; i < entries_.size(); ++i) {
      Entry odometry = entries_[i];
      odometry.kind = Kind::odometry;
      both.push_back(odometry);
      both.push_back(entries_[i]);
      log_.odometry.push_back({0, scan_poses_[i]});
      log_.scans[i].odometry = scan_poses_[i];
    }
    entries_ = std::move(both);
    note("has no ODOM lines; the poses of its " + std::to_string(scan_poses_.size()) +
         " ROBOTLASER1 lines are the odometry");
  }

  /// The logger's times, unless those of the senders tell lines apart that have one time of the logger.
  void choose_times() {
    const auto distinct = [&](auto time_of) {
      size_t count = 0;
      for (size_t i = 1; i < entries_.size(); ++i) count += time_of(entries_[i]) > time_of(entries_[i - 1]) ? 1 : 0;
      return count;
    };
    const size_t logged = distinct([](const Entry&e) { return e.time_s; }),
                 sent = distinct([](const Entry&e) { return e.sent_s; });
    const bool all =
        std::all_of(entries_.begin(), entries_.end(), [](const Entry& e) { return !std::isnan(e.sent_s); });
    if (!all || sent <= 2 * logged) return;
    for (Entry& entry : entries_) entry.time_s = entry.sent_s;
    note("the logger's times are coarse (" + std::to_string(logged + 1) + " for " + std::to_string(entries_.size()) +
         " lines); those of the senders are used");
  }

  /// What was not taken as it is.
  void tell_rest() {
    if (log_.without_time > 0)
      note(std::to_string(log_.without_time) + " of " + std::to_string(entries_.size()) +
           " scans and ODOM lines are left out: they have no time of their own (the first that differs is " +
           std::to_string(static_cast<double>(first_known_ns_) * 1e-9) + " s)");
    if (log_.late_stamps > 0)
      note(std::to_string(log_.late_stamps) + " times were stamped late, or too coarsely, and are spread evenly");
    if (no_numbers_ > 0) note(std::to_string(no_numbers_) + " ranges are inf or NaN: no return");
    if (passed_over_.empty()) return;
    std::string others;
    for (const auto& [name, count] : passed_over_)
      others += (others.empty() ? "" : ", ") + std::to_string(count) + " " + name.substr(0, 40);
    note("messages that are not read: " + others);
  }

  bool geometry(uint32_t beams, double first, double step, double range) {
    if (log_.scans.empty()) {
      log_.beams = beams;
      log_.first_angle_rad = first;
      log_.step_rad = step;
      log_.max_range_m = range;
    }
    if (beams == log_.beams && first == log_.first_angle_rad && step == log_.step_rad && range == log_.max_range_m)
      return true;
    return fail("a scan of " + std::to_string(beams) + " beams unlike the first scan, which has " +
                std::to_string(log_.beams) + ", or with another angle, step or range");
  }

  bool add(CarmenScan scan, size_t first_range) {
    double time_s = 0, range = 0;
    if (!number(words_.size() - 1, time_s)) return false;
    if (!is_time(time_s)) return fail("the logger's time is " + std::string(words_.back()) + " s");
    for (size_t i = 0; i < log_.beams; ++i) {
      if (!this->range(first_range + i, range)) return false;
      log_.range_m.push_back(static_cast<float>(range));
    }
    scan.odometry = odometry_;
    log_.scans.push_back(scan);
    entries_.push_back({Kind::scan, line_, time_s, sent_s()});
    return true;
  }

  bool parameter() {
    if (words_.size() < 3 || words_[1] != "robot_frontlaser_offset") return pass_over();
    return number(2, log_.laser_ahead_m);
  }

  /// An ODOM line and a scan next to it with the same stamp are one instant: the odometry was asked for that scan.
  bool set_times() {
    std::vector<double> seconds;
    std::vector<size_t> instant_of(entries_.size());
    double latest = 0;
    for (size_t i = 0; i < entries_.size(); ++i) {
      const Entry& entry = entries_[i];
      if (latest - entry.time_s > kLargestDelay_s)
        return fail(entry.line, "time goes back by " + std::to_string(latest - entry.time_s) + " s",
                    "cut the log where its clock was set, or delete the line");
      latest = std::max(latest, entry.time_s);
      const bool together = i > 0 && entries_[i - 1].kind != entry.kind && entries_[i - 1].time_s == entry.time_s &&
                            (i < 2 || instant_of[i - 2] != instant_of[i - 1]);
      if (!together) seconds.push_back(entry.time_s);
      instant_of[i] = seconds.size() - 1;
    }
    const LineTimes lines = repair_late_stamps(seconds);
    log_.late_stamps = lines.late;
    if (lines.first_known < lines.time_ns.size()) first_known_ns_ = lines.time_ns[lines.first_known];
    size_t odometry = 0, scan = 0, lost_odometry = 0, lost_scans = 0;
    for (size_t i = 0; i < entries_.size(); ++i) {
      const int64_t time_ns = lines.time_ns[instant_of[i]];
      const bool known = instant_of[i] >= lines.first_known, is_scan = entries_[i].kind == Kind::scan;
      (is_scan ? log_.scans[scan++].time_ns : log_.odometry[odometry++].time_ns) = time_ns;
      if (!known) ++(is_scan ? lost_scans : lost_odometry);
      log_.end_ns = time_ns;
    }
    log_.without_time = lost_scans + lost_odometry;
    log_.scans.erase(log_.scans.begin(), log_.scans.begin() + static_cast<ptrdiff_t>(lost_scans));
    log_.range_m.erase(log_.range_m.begin(), log_.range_m.begin() + static_cast<ptrdiff_t>(lost_scans * log_.beams));
    log_.odometry.erase(log_.odometry.begin(), log_.odometry.begin() + static_cast<ptrdiff_t>(lost_odometry));
    return true;
  }

  std::string id_;
  std::filesystem::path file_;
  int line_ = 0;
  std::vector<std::string_view> words_;
  std::optional<DeviceError> error_;

  CarmenLog log_;
  std::vector<Entry> entries_;
  std::string scan_message_;
  std::vector<PlanarPose> scan_poses_;  ///< of the robot, from ROBOTLASER1
  std::map<std::string, uint64_t> passed_over_;
  uint64_t no_numbers_ = 0;
  int64_t first_known_ns_ = 0;
  std::optional<Pending> pending_;
  bool after_scan_ = false, pending_repeats_scan_ = false;
  PlanarPose odometry_;            ///< newest
  PlanarPose logged_in_odometry_;  ///< frame of the ODOM lines: moves with each correction
};

}  // namespace

tl::expected<CarmenLog, DeviceError> load_carmen_log(const std::string& id, const std::filesystem::path& file,
                                                     uint64_t largest_bytes) {
  return Parser(id, file).parse(largest_bytes);
}

std::vector<TimedPose> corrected_poses(const CarmenLog& log) {
  std::vector<TimedPose> poses;
  for (const CarmenScan& scan : log.scans) {
    if (scan.corrected) poses.push_back({scan.time_ns, scan.logged});
  }
  return poses;
}

}  // namespace takt::replay
