// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "graph/command/eval_command.hpp"
#include "graph/command/run_command.hpp"
#include "nodes/ground_map/evaluate.hpp"
#include "nodes/ground_map/ground_detector.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "nodes/ground_map/pavement_scene.hpp"
#include "nodes/picture/draw.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace ground_map;
using Json = nlohmann::ordered_json;

/// What is wrong with the data, with the file and the next step.
struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double number(const std::string& text, const std::string& value, double low, double high) {
  size_t used = 0;
  double v = low - 1;
  try {
    v = std::stod(value, &used);
  } catch (const std::exception&) {
  }
  if (used != value.size() || !(v >= low && v <= high))
    throw BadData(fmt::format("--set {}: must be a number in {}..{}", text, low, high));
  return v;
}

struct Parameters {
  DetectorParameters detector;
  GridParameters grid;
};

/// By their names at the node.
Parameters parameters(const EvalGroundOptions& options) {
  Parameters all;
  DetectorParameters& p = all.detector;
  for (const std::string& text : options.set) {
    const size_t equals = text.find('=');
    const std::string key = text.substr(0, equals), value = equals == std::string::npos ? "" : text.substr(equals + 1);
    if (key == "t_m") p.t_m = number(text, value, 0, 1e6);
    else if (key == "n_b") p.memory_entries = static_cast<int>(number(text, value, 1, 10000));
    else if (key == "t_w") p.t_w = number(text, value, 0, 5000);
    else if (key == "mean_size") p.mean_size = static_cast<int>(number(text, value, 1, 31));
    else if (text == "votes=columns") all.grid.votes = Votes::columns;
    else if (text == "votes=pixels") all.grid.votes = Votes::pixels;
    else
      throw BadData(fmt::format(
          "--set {}: valid are t_m, n_b, t_w and mean_size with a number, votes=columns and votes=pixels", text));
  }
  if (p.mean_size % 2 == 0) throw BadData(fmt::format("--set mean_size={}: must be odd", p.mean_size));
  return all;
}

ImageView<const uint8_t> view(const cv::Mat& m) {
  return {m.data, m.cols, m.rows, m.channels(), static_cast<ptrdiff_t>(m.step)};
}
ImageView<uint8_t> writable(cv::Mat& m) {
  return {m.data, m.cols, m.rows, m.channels(), static_cast<ptrdiff_t>(m.step)};
}

double quantile(std::vector<double> v, double share) {
  if (v.empty()) return 0;
  const auto at = std::min(v.size() - 1, static_cast<size_t>(share * static_cast<double>(v.size())));
  std::nth_element(v.begin(), v.begin() + static_cast<ptrdiff_t>(at), v.end());
  return v[at];
}

double ms_since(int64_t cpu_ns) { return static_cast<double>(thread_cpu_ns() - cpu_ns) / 1e6; }

Json row(const MaskScore& score, const std::vector<double>* border_errors, std::optional<double> time_ms) {
  Json out{{"precision_pct", score.precision_pct()}, {"recall_pct", score.recall_pct()}};
  if (border_errors) {
    out["border_error_m"] = quantile(*border_errors, 0.5);
    out["border_error_p90_m"] = quantile(*border_errors, 0.9);
  }
  if (time_ms) out["time_ms"] = *time_ms;
  return out;
}

// Recorded images with labels --------------------------------------------------------------------------------------

struct LabelledImage {
  std::filesystem::path image, labels;
  bool teaches = false;
};

std::vector<LabelledImage> labelled_images(const EvalGroundOptions& options) {
  std::vector<LabelledImage> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(options.images, error)) {
    if (!entry.is_regular_file()) continue;
    const std::filesystem::path labels = options.labels / entry.path().filename().replace_extension(".png");
    if (!std::filesystem::exists(labels))
      throw BadData(fmt::format("{}: has no labels {}", entry.path().string(), labels.string()));
    const bool teaches = fnmatch(options.learn.c_str(), entry.path().filename().c_str(), 0) == 0;
    files.push_back({entry.path(), labels, teaches});
  }
  if (files.empty()) throw BadData(fmt::format("{}: no images in this folder", options.images.string()));
  std::sort(files.begin(), files.end(),
            [](const LabelledImage& a, const LabelledImage& b) { return a.image < b.image; });
  const auto teaches = [](const LabelledImage& f) { return f.teaches; };
  if (!options.learn.empty() && std::none_of(files.begin(), files.end(), teaches))
    throw BadData(fmt::format("--learn {}: names no image in {}", options.learn, options.images.string()));
  return files;
}

cv::Mat read(const std::filesystem::path& file, int mode, cv::Size size) {
  cv::Mat image = cv::imread(file.string(), mode);
  if (image.empty()) throw BadData(fmt::format("{}: cannot be read or decoded", file.string()));
  if (!size.empty() && image.size() != size)
    throw BadData(
        fmt::format("{}: {} x {}, expected {} x {}", file.string(), image.cols, image.rows, size.width, size.height));
  return image;
}

/// Class ids to values of Truth.
cv::Mat read_truth(const LabelledImage& file, const EvalGroundOptions& options, cv::Size size) {
  cv::Mat truth = read(file.labels, cv::IMREAD_GRAYSCALE, size);
  cv::Mat table(1, 256, CV_8U, cv::Scalar(static_cast<int>(Truth::other)));
  for (const int id : options.ignore) table.at<uint8_t>(id) = static_cast<uint8_t>(Truth::ignored);
  for (const int id : options.drivable) table.at<uint8_t>(id) = static_cast<uint8_t>(Truth::ground);
  for (auto& value : cv::Mat_<uint8_t>(truth)) value = table.at<uint8_t>(value);
  return truth;
}

/// With --learn the named images teach first and nothing is learnt while all are tested; without it every image teaches
/// just before it is tested, as on the robot.
Json measure_images(const EvalGroundOptions& options) {
  const std::vector<LabelledImage> files = labelled_images(options);
  const cv::Size size = read(files.front().image, cv::IMREAD_COLOR, {}).size();
  GroundDetector detector(size.width, size.height, parameters(options).detector);
  int learnt = 0;
  for (const LabelledImage& file : files)
    if (file.teaches) {
      detector.analyse(view(read(file.image, cv::IMREAD_COLOR, size)));
      learnt += detector.learn();
    }
  MaskScore all, others, trivial;
  std::vector<double> times;
  cv::Mat mask(size, CV_8U);
  for (const LabelledImage& file : files) {
    const cv::Mat image = read(file.image, cv::IMREAD_COLOR, size);
    const cv::Mat truth = read_truth(file, options, size);
    const int64_t start = thread_cpu_ns();
    detector.analyse(view(image));
    if (options.learn.empty()) learnt += detector.learn();
    detector.classify(writable(mask));
    times.push_back(ms_since(start));
    add(all, view(mask), view(truth));
    if (!file.teaches) add(others, view(mask), view(truth));
    bottom_is_ground(writable(mask));
    add(trivial, view(mask), view(truth));
  }
  Json out = row(all, nullptr, quantile(times, 0.5));
  out["frames"] = files.size();
  out["learnt_frames"] = learnt;
  if (!options.learn.empty()) out["not_learnt"] = row(others, nullptr, std::nullopt);
  out["baseline"] = row(trivial, nullptr, std::nullopt);
  return out;
}

// Generated pavement -----------------------------------------------------------------------------------------------

/// How many cells of a map are called wrong.
struct CellScore {
  int64_t free = 0, free_wrong = 0;        ///< wrong: less than half of the cell is drivable
  int64_t blocked = 0, blocked_wrong = 0;  ///< wrong: all of it is
};

double drivable_share(const PavementScene& scene, const FloorPoint& corner, double cell_m) {
  constexpr int kSamples = 6;
  int drivable = 0;
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const int column = i % kSamples, row = i / kSamples;
    drivable +=
        scene.drivable({corner.x_m + (column + 0.5) * cell_m / kSamples, corner.y_m + (row + 0.5) * cell_m / kSamples});
  }
  return static_cast<double>(drivable) / (kSamples * kSamples);
}

void add_cells(CellScore& score, const PavementScene& scene, const GroundGrid& grid) {
  const Window& window = grid.window();
  for (int r = 0; r < window.cells; ++r)
    for (int c = 0; c < window.cells; ++c) {
      const int16_t cell = grid.map().at(c, r);
      const bool free = cell >= 0 && cell<300, blocked = cell> 700;
      if (!free && !blocked) continue;
      const FloorPoint origin = window.origin();
      const double share =
          drivable_share(scene, {origin.x_m + c * window.cell_m, origin.y_m + r * window.cell_m}, window.cell_m);
      score.free += free;
      score.free_wrong += free && share < 0.5;
      score.blocked += blocked;
      score.blocked_wrong += blocked && share == 1;
    }
}

double percent(int64_t part, int64_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Image with the mask in green beside the grid, forward up.
void write_picture(const std::string& file, const cv::Mat& image, const cv::Mat& mask, const GroundGrid& grid) {
  const int scale = std::max(1, image.rows / grid.window().cells), side = scale * grid.window().cells;
  cv::Mat out(std::max(image.rows, side), image.cols + 8 + side, CV_8UC3, cv::Scalar(40, 40, 40));
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      cv::Vec3b pixel = image.at<cv::Vec3b>(y, x);
      if (mask.at<uint8_t>(y, x))
        pixel = {static_cast<uint8_t>(pixel[0] / 2), static_cast<uint8_t>(pixel[1] / 2 + 127),
                 static_cast<uint8_t>(pixel[2] / 2)};
      out.at<cv::Vec3b>(y, x) = pixel;
    }
  cv::Mat part(out, cv::Rect(image.cols + 8, 0, side, side));
  picture::draw_grid(grid.map(), scale, {part.data, side, side, 3, static_cast<ptrdiff_t>(part.step)});
  if (!cv::imwrite(file, out)) throw BadData(fmt::format("{}: cannot be written", file));
}

Json measure_pavement(const EvalGroundOptions& options) {
  PavementOptions make;
  make.seed = options.seed;
  make.frames = options.frames;
  const PavementScene scene(make);
  const Parameters p = parameters(options);
  GroundDetector detector(make.width, make.height, p.detector);
  GroundGrid grid(make.width, p.grid);
  cv::Mat image(make.height, make.width, CV_8UC3), truth(image.size(), CV_8U), mask(image.size(), CV_8U);
  MaskScore score, trivial;
  CellScore cells;
  std::vector<double> errors, trivial_errors, times;
  const FloorProjection in_robot = floor_projection(scene.camera(), scene.camera_in_robot());
  const FloorPoint foot{scene.camera_in_robot().x, scene.camera_in_robot().y};
  const auto borders = [&](const cv::Mat& m, uint8_t ground) {
    return free_range(view(m), ground, in_robot, foot, p.grid.range_max_m);
  };
  for (int frame = 0; frame < make.frames; ++frame) {
    scene.render(frame, writable(image), writable(truth));
    const PlanarPose robot = scene.robot_in_map(frame);
    const int64_t start = thread_cpu_ns();
    detector.analyse(view(image));
    detector.learn();
    detector.classify(writable(mask));
    grid.centre({robot.x_m, robot.y_m});
    grid.observe(view(mask), in_robot.moved(robot), {robot.x_m, robot.y_m});
    grid.accumulate();
    times.push_back(ms_since(start));
    const auto true_borders = borders(truth, static_cast<uint8_t>(Truth::ground));
    add(score, view(mask), view(truth));
    add_border_errors(borders(mask, 255), true_borders, p.grid.range_max_m, errors);
    add_cells(cells, scene, grid);
    if (!options.picture.empty() && frame + 1 == make.frames) write_picture(options.picture, image, mask, grid);
    bottom_is_ground(writable(mask));
    add(trivial, view(mask), view(truth));
    add_border_errors(borders(mask, 255), true_borders, p.grid.range_max_m, trivial_errors);
  }
  Json out = row(score, &errors, quantile(times, 0.5));
  out["frames"] = make.frames;
  out["grid"] = {{"free_wrong_pct", percent(cells.free_wrong, cells.free)},
                 {"blocked_wrong_pct", percent(cells.blocked_wrong, cells.blocked)}};
  out["baseline"] = row(trivial, &trivial_errors, std::nullopt);
  return out;
}

// Output -----------------------------------------------------------------------------------------------------------

void print_row(const char* name, const Json& r) {
  const auto text = [&](const char* key, int digits) {
    return r.contains(key) ? fmt::format("{:.{}f}", r[key].get<double>(), digits) : std::string("-");
  };
  std::printf("%-30s %12s %9s %9s %7s %8s\n", name, text("precision_pct", 2).c_str(), text("recall_pct", 2).c_str(),
              text("border_error_m", 3).c_str(), text("border_error_p90_m", 3).c_str(), text("time_ms", 2).c_str());
}

void print(const Json& out) {
  std::printf("%-30s %12s %9s %9s %7s %8s\n", "method", "precision %", "recall %", "border m", "p90 m", "CPU ms");
  print_row("takt ground_map", out);
  if (out.contains("not_learnt")) print_row("  on images not learnt from", out["not_learnt"]);
  print_row("bottom 40 % is ground", out["baseline"]);
  if (out.contains("grid"))
    std::printf("grid: %.2f %% of the free and %.2f %% of the occupied cells wrong\n",
                out["grid"]["free_wrong_pct"].get<double>(), out["grid"]["blocked_wrong_pct"].get<double>());
}

int evaluate(const EvalGroundOptions& options) {
  try {
    if (options.images.empty() != options.labels.empty() || options.images.empty() != options.drivable.empty())
      throw BadData("--images, --labels and --drivable belong together; without them a pavement is generated");
    if (options.images.empty() && !options.learn.empty())
      throw BadData("--learn names images, so it wants --images; on a generated pavement each image teaches in turn");
    Json out = options.images.empty() ? measure_pavement(options) : measure_images(options);
    out["baseline"]["name"] = "bottom 40 % of the image is ground";
    if (options.json) std::printf("%s\n", out.dump(2).c_str());
    else print(out);
    return kOk;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt: error: %s\n", error.what());
    return kBadInput;
  }
}

}  // namespace

void add_eval_ground(CLI::App& eval, EvalGroundOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("ground", "ground mask against labels, or on a pavement that is generated");
  app->add_option("--images", o.images, "folder with colour images");
  app->add_option("--labels", o.labels, "folder with a PNG of class ids for each image, of the same name");
  app->add_option("--drivable", o.drivable, "class ids that are ground, e.g. 3,4")
      ->delimiter(',')
      ->check(CLI::Range(0, 255));
  app->add_option("--ignore", o.ignore, "class ids that are not counted")->delimiter(',')->check(CLI::Range(0, 255));
  app->add_option("--learn", o.learn, "images that teach before all are tested, e.g. 'first*' (default: each in turn)");
  app->add_option("--set", o.set, "parameter=value of the ground_map node, repeatable");
  app->add_option("--seed", o.seed, "seed of the generated pavement (default 1)");
  app->add_option("--frames", o.frames, "images along the generated drive (default 60)")->check(CLI::Range(1, 100000));
  app->add_option("--picture", o.picture, "PNG of the last generated image with its mask, and the grid");
  app->add_flag("--json", o.json, "one JSON object on stdout");
  app->callback([&] { exit_code = evaluate(o); });
}

}  // namespace takt::command
