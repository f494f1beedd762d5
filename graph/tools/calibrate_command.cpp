// SPDX-License-Identifier: Apache-2.0
#include "graph/tools/calibrate_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <stdexcept>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "hal/replay/stereo_files.hpp"
#include "hal/settings/json.hpp"
#include "nodes/calibration/calibrate.hpp"
#include "nodes/calibration/epipolar.hpp"
#include "nodes/calibration/image_pairs.hpp"
#include "nodes/calibration/picture.hpp"
#include "nodes/picture/image_file.hpp"
#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/rectification_monitor.hpp"

namespace takt::command {
namespace {

using namespace calibration;
using Json = nlohmann::ordered_json;

constexpr const char* kReferenceFile = "intrinsics.yml";
constexpr size_t kGoodViews = 10;
constexpr double kGoodCoverage = 0.5;

struct BadInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Board board_of(const CalibrateOptions& options) {
  Board board;
  char more = 0;
  const int read = std::sscanf(options.board.c_str(), "%dx%d%c", &board.columns, &board.rows, &more);
  if (read != 2 || std::min(board.columns, board.rows) < 3 || std::max(board.columns, board.rows) > 50)
    throw BadInput(
        fmt::format("--board {}: must be COLUMNSxROWS of inner corners, each 3..50, for instance 9x6", options.board));
  if (board.columns == board.rows)
    throw BadInput(fmt::format("--board {}: columns and rows must differ, or nobody can tell how the board is turned",
                               options.board));
  if (options.square_m > 0) board.square = options.square_m;
  return board;
}

/// Pairs of a folder, and what was seen in them.
struct Recording {
  std::vector<ImagePair> files;
  std::vector<GreyPair> images;
  std::vector<View> views;          ///< pairs in which both images show the whole board
  std::vector<size_t> view_images;  ///< index of each view's pair
  std::vector<std::string> without_board;

  cv::Size size() const { return images.front().left.size(); }
};

Recording look_at(const CalibrateOptions& options, const Board& board) {
  Recording all;
  all.files = find_pairs(options.folder, options.left, options.right);
  for (const ImagePair& pair : all.files)
    for (const auto& file : {pair.left, pair.right})
      if (const auto complete = replay::check_complete(file); !complete)
        throw BadInput(fmt::format("{}: {}", file.string(), complete.error()));
  all.images = read_pairs(all.files);
  for (size_t i = 0; i < all.files.size(); ++i) {
    View view{all.files[i].name, find_corners(all.images[i].left, board), find_corners(all.images[i].right, board)};
    if (view.left.empty()) all.without_board.push_back(all.files[i].left.filename().string());
    if (view.right.empty()) all.without_board.push_back(all.files[i].right.filename().string());
    if (view.left.empty() || view.right.empty()) continue;
    order_like(view.left, view.right);
    all.views.push_back(std::move(view));
    all.view_images.push_back(i);
  }
  if (all.views.size() < kLeastViews)
    throw BadInput(
        fmt::format("{}: only {} of {} pairs show a whole board of {} inner corners, at least {} must; no "
                    "board was found in {}",
                    options.folder.string(), all.views.size(), all.files.size(), options.board, kLeastViews,
                    fmt::join(all.without_board, ", ")));
  return all;
}

/// A fit, and what its calibration makes of the pairs.
struct Judged {
  Fit fit;
  std::vector<RectifiedPair> rectified;
  std::optional<EpipolarError> epipolar;
};

Judged judge(Fit fit, const Recording& recording, const std::vector<size_t>& used, const Board& board) {
  Judged out{std::move(fit), {}, {}};
  stereo::Rectifier rectifier(out.fit.cameras);
  for (const size_t view : used)
    out.rectified.push_back(rectify(rectifier, recording.images[recording.view_images[view]], board));
  out.epipolar = epipolar_error(out.rectified);
  return out;
}

/// Everything that is found out.
struct Outcome {
  Recording recording;
  CalibrationResult result;
  Judged ours;
  std::optional<Judged> reference;  ///< the cameras of the reference file, with the pose that fits the same views best
  std::vector<std::string> doubts;
};

void judge_reference(const std::filesystem::path& file, const Board& board, Outcome& out) {
  if (!std::filesystem::exists(file)) return;
  try {
    stereo::StereoCalibration cameras = stereo::read_intrinsics(file);
    cameras.width = out.recording.size().width;
    cameras.height = out.recording.size().height;
    std::vector<View> views;
    for (const size_t view : out.result.used) views.push_back(out.recording.views[view]);
    out.reference = judge(fit_pose(views, board, cameras), out.recording, out.result.used, board);
  } catch (const std::invalid_argument& error) {
    out.doubts.push_back(fmt::format("not compared with the reference: {}", error.what()));
  }
}

double seen(const Outcome& out, std::vector<cv::Point2f> View::*corners) {
  std::vector<std::vector<cv::Point2f>> used;
  for (const size_t view : out.result.used) used.push_back(out.recording.views[view].*corners);
  return coverage(used, out.recording.size());
}

void find_doubts(bool metric, Outcome& out) {
  const auto doubt = [&](std::string text) { out.doubts.push_back(std::move(text)); };
  if (!metric) doubt("without --square the baseline is in squares of the board; distances will be, too");
  if (out.result.used.size() < kGoodViews)
    doubt(fmt::format("{} views are few, 15 or more are good", out.result.used.size()));
  for (const auto& [side, corners] : {std::pair("left", &View::left), std::pair("right", &View::right)})
    if (const double share = seen(out, corners); share < kGoodCoverage)
      doubt(fmt::format("the board was seen in {:.0f} % of the {} image only; what lies elsewhere is guessed",
                        100 * share, side));
  const std::optional<EpipolarError>& epipolar = out.ours.epipolar;
  if (!epipolar) doubt("no pair shows the whole board once rectified: the epipolar error was not measured");
  else if (epipolar->median_px > stereo::RowErrorAlarm::kDoubtful)
    doubt(fmt::format("an epipolar error of {:.2f} px (median) is too much for stereo", epipolar->median_px));
}

Outcome find_out(const CalibrateOptions& options) {
  const Board board = board_of(options);
  Outcome out{look_at(options, board), {}, {}, {}, {}};
  out.result = calibrate(out.recording.views, board, out.recording.size());
  out.ours = judge(out.result.fit, out.recording, out.result.used, board);
  judge_reference(options.folder / kReferenceFile, board, out);
  find_doubts(options.square_m > 0, out);
  return out;
}

void write_files(const CalibrateOptions& options, const Outcome& out) {
  const Fit& fit = out.result.fit;
  if (!options.out.empty())
    stereo::write_calibration(options.out, fit.cameras,
                              fmt::format("takt calibrate stereo: {} of {} pairs, board {}, {}, reprojection {:.3f} px",
                                          out.result.used.size(), out.recording.files.size(), options.board,
                                          options.square_m > 0 ? fmt::format("squares of {} m", options.square_m)
                                                               : "T in squares, not metres",
                                          fit.both_px));
  if (options.picture.empty()) return;
  const std::vector<RectifiedPair>& pairs = out.ours.rectified;
  const auto whole = std::find_if(pairs.begin(), pairs.end(), [](const RectifiedPair& p) { return !p.left.empty(); });
  const cv::Mat picture =
      draw_calibration(whole == pairs.end() ? pairs.front() : *whole, out.recording.views, out.result);
  require_written(picture::write_image(options.picture, picture));
}

double baseline(const stereo::StereoCalibration& c) { return cv::norm(cv::Vec3d(c.translation_m.data())); }

Json to_json(const Judged& judged) {
  const stereo::StereoCalibration& c = judged.fit.cameras;
  const auto camera = [](const std::array<double, 9>& m, const std::array<double, 5>& d) {
    return Json{{"focal_px", {m[0], m[4]}}, {"centre_px", {m[2], m[5]}}, {"distortion", d}};
  };
  Json epipolar = nullptr;
  if (const auto& e = judged.epipolar)
    epipolar = {{"mean", e->mean_px}, {"median", e->median_px}, {"p95", e->p95_px}, {"pairs", e->pairs}};
  return {
      {"reprojection_px", {{"left", judged.fit.left_px}, {"right", judged.fit.right_px}, {"both", judged.fit.both_px}}},
      {"epipolar_px", epipolar},
      {"left", camera(c.left_matrix, c.left_distortion)},
      {"right", camera(c.right_matrix, c.right_distortion)},
      {"rotation", c.rotation},
      {"translation", c.translation_m},
      {"baseline", baseline(c)}};
}

Json to_json(const CalibrateOptions& options, const Outcome& out) {
  const Board board = board_of(options);
  const std::vector<View>& views = out.recording.views;
  Json json{{"folder", options.folder.string()},
            {"pairs", out.recording.files.size()},
            {"image_px", {out.recording.size().width, out.recording.size().height}},
            {"board", {board.columns, board.rows}},
            {"square_m", options.square_m > 0 ? Json(options.square_m) : Json(nullptr)},
            {"used", Json::array()},
            {"rejected", Json::array()},
            {"without_board", out.recording.without_board},
            {"coverage", {{"left", seen(out, &View::left)}, {"right", seen(out, &View::right)}}},
            {"calibration", to_json(out.ours)}};
  for (size_t i = 0; i < out.result.used.size(); ++i)
    json["used"].push_back({{"view", views[out.result.used[i]].name}, {"error_px", out.result.fit.view_px[i]}});
  for (const RejectedView& r : out.result.rejected)
    json["rejected"].push_back({{"view", views[r.view].name}, {"error_px", r.error_px}, {"limit_px", r.limit_px}});
  if (out.reference) json["reference"] = to_json(*out.reference);
  json["doubts"] = out.doubts;
  return json;
}

// The table ---------------------------------------------------------------------------------------------------------

std::string views_text(const Outcome& out) {
  const std::vector<View>& views = out.recording.views;
  std::string used, rejected;
  for (size_t i = 0; i < out.result.used.size(); ++i)
    used += fmt::format(" {} ({:.2f})", views[out.result.used[i]].name, out.result.fit.view_px[i]);
  for (const RejectedView& r : out.result.rejected)
    rejected += fmt::format(" {} ({:.2f}, limit {:.2f})", views[r.view].name, r.error_px, r.limit_px);
  const auto& none = out.recording.without_board;
  return fmt::format("used (reprojection, RMS px):{}\nrejected:{}\nno board in: {}\n", used,
                     rejected.empty() ? " none" : rejected,
                     none.empty() ? "none" : fmt::format("{}", fmt::join(none, " ")));
}

std::string table_text(bool metric, const Judged& ours, const Judged* reference) {
  const auto beside = [&](const auto& words) { return reference ? fmt::format("{:>20}", words) : std::string(); };
  std::string table = fmt::format("\n{:<30}{:>20}{}\n", "", "takt", beside(kReferenceFile));
  const auto line = [&](const char* name, const auto& text) {
    table += fmt::format("{:<30}{:>20}{}\n", name, text(ours), beside(reference ? text(*reference) : ""));
  };
  const auto number = [&](const char* name, const auto& value) {
    line(name, [&](const Judged& j) { return fmt::format("{:.3f}", value(j)); });
  };
  const auto epipolar = [&](const char* name, double EpipolarError::*value) {
    line(name, [=](const Judged& j) { return j.epipolar ? fmt::format("{:.3f}", *j.epipolar.*value) : "-"; });
  };
  const auto camera = [&](const char* name, const auto& values, size_t first, size_t second) {
    line(name, [&](const Judged& j) {
      const auto& v = values(j.fit.cameras);
      return fmt::format("{:.6g} {:.6g}", v[first], v[second]);
    });
  };
  number("reprojection left, RMS px", [](const Judged& j) { return j.fit.left_px; });
  number("reprojection right, RMS px", [](const Judged& j) { return j.fit.right_px; });
  number("reprojection stereo, RMS px", [](const Judged& j) { return j.fit.both_px; });
  epipolar("epipolar error, mean px", &EpipolarError::mean_px);
  epipolar("epipolar error, median px", &EpipolarError::median_px);
  epipolar("epipolar error, p95 px", &EpipolarError::p95_px);
  line("  measured in pairs", [](const Judged& j) { return fmt::format("{}", j.epipolar ? j.epipolar->pairs : 0); });
  using Cameras = stereo::StereoCalibration;
  const auto left_matrix = [](const Cameras& c) { return c.left_matrix; };
  const auto right_matrix = [](const Cameras& c) { return c.right_matrix; };
  camera("left focal lengths, px", left_matrix, 0, 4);
  camera("left principal point, px", left_matrix, 2, 5);
  camera(
      "left k1 k2", [](const Cameras& c) { return c.left_distortion; }, 0, 1);
  camera("right focal lengths, px", right_matrix, 0, 4);
  camera("right principal point, px", right_matrix, 2, 5);
  camera(
      "right k1 k2", [](const Cameras& c) { return c.right_distortion; }, 0, 1);
  line(metric ? "baseline, m" : "baseline, squares",
       [](const Judged& j) { return fmt::format("{:.5f}", baseline(j.fit.cameras)); });
  return table;
}

std::string text(const CalibrateOptions& options, const Outcome& out) {
  return fmt::format("{} pairs of {} x {} px, board {}\n", out.recording.files.size(), out.recording.size().width,
                     out.recording.size().height, options.board) +
         views_text(out) +
         fmt::format("corners in {:.0f} % of the left image, {:.0f} % of the right\n", 100 * seen(out, &View::left),
                     100 * seen(out, &View::right)) +
         table_text(options.square_m > 0, out.ours, out.reference ? &*out.reference : nullptr) +
         (options.out.empty() ? "not written to a file; --out FILE.yaml does\n"
                              : fmt::format("written to {}\n", options.out.string()));
}

int calibrate_stereo(const CalibrateOptions& options) {
  try {
    const Outcome out = find_out(options);
    write_files(options, out);
    std::fputs((options.json ? to_json(options, out).dump(2) + "\n" : text(options, out)).c_str(), stdout);
    for (const std::string& doubt : out.doubts) std::fprintf(stderr, "takt: warning: %s\n", doubt.c_str());
    return kOk;
  } catch (const std::exception& error) {
    return refuse(error);
  }
}

}  // namespace

void add_calibrate(CLI::App& app, CalibrateOptions& o, int& exit_code) {
  CLI::App* calibrate = app.add_subcommand("calibrate", "measures cameras and lasers from recordings");
  calibrate->require_subcommand(1);
  CLI::App* stereo = calibrate->add_subcommand("stereo", "lenses and pose of a stereo camera, from pairs of pictures");
  reads_folder(stereo->add_option("folder", o.folder, "folder with the pairs"))->required();
  stereo->add_option("--board", o.board, "inner corners of the chessboard, COLUMNSxROWS (default 9x6)");
  stereo->add_option("--square", o.square_m, "edge of its squares, m (default: unknown)")->check(CLI::PositiveNumber);
  stereo->add_option("--left", o.left, "names of the left images (default left*.jpg)");
  stereo->add_option("--right", o.right, "names of the right images (default right*.jpg)");
  writes_file(stereo->add_option("--out", o.out,
                                 "writes the calibration to this file (.yaml), for `calibration` of the stereo node"));
  writes_file(stereo->add_option(
      "--picture", o.picture, "writes a picture (.png): a rectified pair with epipolar lines, and where corners were"));
  stereo->add_flag("--json", o.json, "one JSON object on stdout");
  stereo->callback([&] { exit_code = calibrate_stereo(o); });
  add_calibrate_lasers(*calibrate, o.lasers, exit_code);
  add_calibrate_rig(*calibrate, o.rig, exit_code);
}

}  // namespace takt::command
