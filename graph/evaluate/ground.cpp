// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/ground_score.hpp"
#include "hal/settings/json.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace ground_map;
using Json = nlohmann::ordered_json;

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
      throw std::runtime_error(fmt::format("{}: has no labels {}", entry.path().string(), labels.string()));
    const bool teaches = fnmatch(options.learn.c_str(), entry.path().filename().c_str(), 0) == 0;
    files.push_back({entry.path(), labels, teaches});
  }
  if (files.empty()) throw std::runtime_error(fmt::format("{}: no images in this folder", options.images.string()));
  std::sort(files.begin(), files.end(),
            [](const LabelledImage& a, const LabelledImage& b) { return a.image < b.image; });
  const auto teaches = [](const LabelledImage& f) { return f.teaches; };
  if (!options.learn.empty() && std::none_of(files.begin(), files.end(), teaches))
    throw std::runtime_error(fmt::format("--learn {}: names no image in {}", options.learn, options.images.string()));
  return files;
}

cv::Mat read(const std::filesystem::path& file, int mode, cv::Size size) {
  cv::Mat image = mode == cv::IMREAD_UNCHANGED
                      ? read_values(file)
                      : read_image(file, mode == cv::IMREAD_COLOR ? Channels::colour : Channels::grey);
  if (!size.empty() && image.size() != size)
    throw std::runtime_error(
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

/// What the reference area of one image teaches; none if no bin is full enough.
std::optional<Descriptor> texture_of(const cv::Mat& image, const DetectorParameters& p) {
  GroundDetector detector(image.cols, image.rows, p);
  detector.analyse(view(image));
  if (!detector.learn()) return std::nullopt;
  return detector.memory().by_age(0);
}

/// The drive that an image is of: its name up to the first underscore.
std::string drive_of(const LabelledImage& file) {
  const std::string name = file.image.filename().string();
  return name.substr(0, name.find('_'));
}

/// Calls the ground of every image by what `teach` puts into an empty memory.
class ImageTest {
 public:
  ImageTest(cv::Size size, const DetectorParameters& p) : size_(size), p_(p), mask_(size, CV_8U) {}

  template <class Teach>
  void add(const cv::Mat& image, const cv::Mat& truth, const Teach& teach) {
    GroundDetector detector(size_.width, size_.height, p_);
    teach(detector);
    const int64_t start = thread_cpu_ns();
    detector.analyse(view(image));
    detector.classify(writable(mask_));
    times_.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
    least_light_ = std::min(least_light_, detector.light());
    if (detector.too_dark()) ++too_dark_;
    else ground_map::add(score_, view(mask_), view(truth));
  }
  Json row() const {
    Json out = ground_row(score_, nullptr, quantile(times_, 0.5));
    out["least_light"] = least_light_;
    out["too_dark"] = too_dark_;
    return out;
  }

 private:
  cv::Size size_;
  DetectorParameters p_;
  cv::Mat mask_;
  MaskScore score_;
  std::vector<double> times_;
  double least_light_ = 255;
  size_t too_dark_ = 0;
};

/// What is chosen on the images of one drive: the most recall that keeps the precision wanted, else the most precision.
struct Candidate {
  int mean_size = 0;
  double t_m = 0;
  std::map<std::string, MaskScore> on;  ///< by drive, each image having learnt from itself alone

  /// Whether this one is to be taken before the other.
  bool before(const Candidate& other, const std::string& drive) const {
    constexpr double kPrecision_pct = 97;
    const MaskScore &a = on.at(drive), &b = other.on.at(drive);
    if ((a.precision_pct() >= kPrecision_pct) != (b.precision_pct() >= kPrecision_pct))
      return a.precision_pct() >= kPrecision_pct;
    return a.precision_pct() >= kPrecision_pct ? a.recall_pct() > b.recall_pct()
                                               : a.precision_pct() > b.precision_pct();
  }
};

std::vector<Candidate> candidates(const EvalGroundOptions& options, const std::vector<LabelledImage>& files,
                                  DetectorParameters p, cv::Size size) {
  std::vector<Candidate> out;
  cv::Mat mask(size, CV_8U);
  for (const int mean_size : {5, 7, 9, 11})
    for (const double t_m : {60.0, 80.0, 100.0}) {
      p.mean_size = mean_size;
      p.t_m = t_m;
      Candidate candidate{mean_size, t_m, {}};
      for (const LabelledImage& file : files) {
        GroundDetector detector(size.width, size.height, p);
        detector.analyse(view(read(file.image, cv::IMREAD_COLOR, size)));
        detector.learn();
        detector.classify(writable(mask));
        ground_map::add(candidate.on[drive_of(file)], view(mask), view(read_truth(file, options, size)));
      }
      out.push_back(std::move(candidate));
    }
  return out;
}

/// For each drive two parameters are chosen on it, and held against the images of the others, which had no say in it.
Json held_out(const EvalGroundOptions& options, const std::vector<LabelledImage>& files, const DetectorParameters& p,
              cv::Size size) {
  const std::vector<Candidate> all = candidates(options, files, p, size);
  MaskScore pooled;
  Json choices = Json::array();
  for (const auto& entry : all.front().on) {
    const std::string& drive = entry.first;
    const Candidate& best = *std::min_element(
        all.begin(), all.end(), [&](const Candidate& a, const Candidate& b) { return a.before(b, drive); });
    MaskScore others;
    for (const auto& [other, score] : best.on) {
      if (other == drive) continue;
      for (MaskScore* sum : {&others, &pooled})
        sum->right += score.right, sum->wrong += score.wrong, sum->missed += score.missed;
    }
    choices.push_back({{"chosen_on", drive}, {"mean_size", best.mean_size}, {"t_m", best.t_m}});
    choices.back().update(ground_row(others, nullptr, std::nullopt));
  }
  Json out = ground_row(pooled, nullptr, std::nullopt);
  out["choices"] = choices;
  return out;
}

/// Each image learns from its own reference area only, or also from all images of the other drives; with --learn from
/// the named images and not from its own.
Json measure_images(const EvalGroundOptions& options) {
  const std::vector<LabelledImage> files = labelled_images(options);
  const DetectorParameters p = ground_parameters(options.set).detector;
  const cv::Size size = read(files.front().image, cv::IMREAD_COLOR, {}).size();
  std::vector<std::optional<Descriptor>> textures;
  for (const LabelledImage& file : files) textures.push_back(texture_of(read(file.image, cv::IMREAD_COLOR, size), p));
  ImageTest own(size, p), others(size, p), taught(size, p), not_learnt(size, p);
  MaskScore trivial;
  cv::Mat mask(size, CV_8U);
  bottom_is_ground(writable(mask));
  for (size_t i = 0; i < files.size(); ++i) {
    const cv::Mat image = read(files[i].image, cv::IMREAD_COLOR, size), truth = read_truth(files[i], options, size);
    const auto recall = [&](GroundDetector& detector, const auto& wanted) {
      for (size_t k = 0; k < files.size(); ++k)
        if (wanted(k) && textures[k]) detector.recall(*textures[k]);
    };
    const auto is_own = [&](size_t k) { return k == i; };
    const auto is_other = [&](size_t k) { return drive_of(files[k]) != drive_of(files[i]); };
    const auto teaches = [&](size_t k) { return files[k].teaches; };
    if (options.learn.empty()) {
      own.add(image, truth, [&](GroundDetector& detector) { recall(detector, is_own); });
      others.add(image, truth, [&](GroundDetector& detector) {
        recall(detector, is_other);
        recall(detector, is_own);
      });
    } else {
      taught.add(image, truth, [&](GroundDetector& detector) { recall(detector, teaches); });
      if (!files[i].teaches) not_learnt.add(image, truth, [&](GroundDetector& detector) { recall(detector, teaches); });
    }
    add(trivial, view(mask), view(truth));
  }
  Json out = options.learn.empty() ? own.row() : taught.row();
  out["frames"] = files.size();
  if (options.learn.empty()) {
    out["with_other_drives"] = others.row();
    if (std::any_of(files.begin(), files.end(), [&](const auto& f) { return drive_of(f) != drive_of(files[0]); }))
      out["chosen_on_another_drive"] = held_out(options, files, p, size);
  } else {
    out["not_learnt"] = not_learnt.row();
  }
  out["baseline"] = ground_row(trivial, nullptr, std::nullopt);
  return out;
}

// Output -----------------------------------------------------------------------------------------------------------

void print_row(const std::string& name, const Json& r) {
  const auto text = [](const Json& from, const char* key, int digits) {
    return from.contains(key) ? fmt::format("{:.{}f}", from[key].get<double>(), digits) : std::string("-");
  };
  const Json grid = r.contains("grid") ? r["grid"] : Json::object();
  std::printf("%-34s %11s %8s %8s %6s %9s %10s %10s %10s %7s\n", name.c_str(), text(r, "precision_pct", 2).c_str(),
              text(r, "recall_pct", 2).c_str(), text(r, "border_error_m", 3).c_str(),
              text(r, "border_error_p90_m", 2).c_str(), text(grid, "free_wrong_pct", 2).c_str(),
              text(grid, "blocked_wrong_pct", 2).c_str(), text(r, "false_borders_doubted_pct", 1).c_str(),
              text(r, "true_borders_doubted_pct", 1).c_str(), text(r, "time_ms", 2).c_str());
}

/// Of takt ground_map, over all images.
void print_cells(const Json& confusion) {
  constexpr const char* kTruth[] = {"drivable", "half of it and more", "not drivable"};
  std::printf("%-34s %11s %11s %11s\n", "seen cells, truth", "free", "undecided", "occupied");
  for (size_t truth = 0; truth < std::size(kTruth); ++truth)
    std::printf("%-34s %11ld %11ld %11ld\n", kTruth[truth], confusion[truth][0].get<long>(),
                confusion[truth][1].get<long>(), confusion[truth][2].get<long>());
}

void print(const Json& out) {
  std::printf("%-34s %11s %8s %8s %6s %20s %21s %7s\n", "", "", "", "", "", "wrong cells, % of", "borders doubted, %",
              "");
  std::printf("%-34s %11s %8s %8s %6s %9s %10s %10s %10s %7s\n", "method", "precision %", "recall %", "border m",
              "p90 m", "free", "occupied", "of false", "of true", "CPU ms");
  print_row("takt ground_map", out);
  if (out.contains("with_other_drives")) print_row("  memory of the other drives, too", out["with_other_drives"]);
  if (out.contains("chosen_on_another_drive")) {
    print_row("  chosen on another drive", out["chosen_on_another_drive"]);
    for (const Json& choice : out["chosen_on_another_drive"]["choices"])
      print_row(fmt::format("    on {}: mean {}, t_m {:g}", choice["chosen_on"].get<std::string>(),
                            choice["mean_size"].get<int>(), choice["t_m"].get<double>()),
                choice);
  }
  if (out.contains("not_learnt")) print_row("  on images not learnt from", out["not_learnt"]);
  if (out.contains("variants"))
    for (const auto& [name, row] : out["variants"].items()) print_row(name, row);
  print_row("bottom 40 % is ground", out["baseline"]);
  if (out.contains("least_light"))
    std::printf(
        "light of the reference area: at least %.0f of 255; %zu of %zu images too dark to be judged (light_min)\n",
        out["least_light"].get<double>(), out["too_dark"].get<size_t>(), out["frames"].get<size_t>());
  if (out.contains("grid")) print_cells(out["grid"]["confusion"]);
  if (!out.contains("projection")) return;
  std::printf("floor from pixels: off by at most %.1e m at any turn of the head\n",
              out["projection"]["turned_head_max_m"].get<double>());
  std::printf("%8s %12s %14s %16s\n", "at m", "error m", "half a pixel m", "thesis's chain m");
  for (const Json& at : out["projection"]["at"])
    std::printf("%8.0f %12.1e %14.3f %16.3f\n", at["range_m"].get<double>(), at["exact_error_m"].get<double>(),
                at["half_pixel_m"].get<double>(), at["thesis_error_m"].get<double>());
}

}  // namespace

int evaluate(const EvalGroundOptions& options) {
  if (options.images.empty() != options.labels.empty() || options.images.empty() != options.drivable.empty())
    throw std::runtime_error("--images, --labels and --drivable belong together; without them a pavement is generated");
  if (options.images.empty() && !options.learn.empty())
    throw std::runtime_error(
        "--learn names images, so it wants --images; on a generated pavement each image teaches in turn");
  if (!options.images.empty() && options.variants)
    throw std::runtime_error("--variants are those of the generated pavement, so it wants no --images");
  Json out = options.images.empty() ? measure_pavement(options) : measure_images(options);
  out["baseline"]["name"] = "bottom 40 % of the image is ground";
  if (options.json) std::printf("%s\n", out.dump(2).c_str());
  else print(out);
  return kOk;
}

}  // namespace takt::command
