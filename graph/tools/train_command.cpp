// SPDX-License-Identifier: Apache-2.0
#include "graph/tools/train_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "nodes/picture/curves.hpp"
#include "nodes/picture/image_file.hpp"
#include "nodes/traffic_signs/flat_sign.hpp"
#include "nodes/traffic_signs/layout_learning.hpp"
#include "nodes/traffic_signs/sign_scenes.hpp"
#include "nodes/traffic_signs/training.hpp"

namespace takt::command {
namespace {

using namespace traffic_signs;

constexpr uint64_t kHeldOut = 1u << 20;  // indices from here on are for measuring
constexpr int kHeldOutPositives = 1000, kHeldOutImages = 40;

/// Scenes for all classes, each with the signs in it; fuller than those that `takt eval signs` makes, and with things
/// that are like signs.
std::vector<SignScene> scenes(uint64_t seed, uint64_t first, int count) {
  traffic_signs::SceneParameters p;
  p.shapes_min = 20, p.shapes_max = 90;
  p.most_decoys = 8;
  std::vector<SignScene> scenes;
  for (int i = 0; i < count; ++i) scenes.push_back(make_scene(p, seed, first + static_cast<uint64_t>(i)));
  return scenes;
}

TrainingSet set_for(SignClass sign, const std::vector<SignScene>& scenes, uint64_t seed, uint64_t first,
                    int positives) {
  TrainingSet set;
  for (int i = 0; i < positives; ++i)
    set.positives.push_back(make_positive(sign, seed, first + static_cast<uint64_t>(i)));
  for (const SignScene& scene : scenes) {
    NegativeImage& image = set.negatives.emplace_back();
    cv::cvtColor(scene.image, image.grey, cv::COLOR_BGR2GRAY);
    for (const PlacedSign& placed : scene.signs)
      if (placed.sign == sign) image.objects.push_back(placed.box);
  }
  return set;
}

void write_curve(const std::string& stem, const StageCurve& curve) {
  std::string table = "stages,missed_pct,false_positives_per_million_windows\n";
  std::vector<double> stages;
  for (size_t i = 0; i < curve.missed_pct.size(); ++i) {
    stages.push_back(static_cast<double>(i + 1));
    table += fmt::format("{},{:.2f},{:.3f}\n", i + 1, curve.missed_pct[i], curve.false_positives_per_million[i]);
  }
  require_written(write_file(stem + ".csv", table));
  picture::write_curves(
      stem + ".png", "stages", stages,
      {{"missed %", curve.missed_pct}, {"false positives per million windows", curve.false_positives_per_million}});
}

const SignShape& shape_of(const std::string& name) {
  const auto found =
      std::find_if(kSignShapes.begin(), kSignShapes.end(), [&](auto& shape) { return shape.name == name; });
  if (found != kSignShapes.end()) return *found;
  std::string names;
  for (const SignShape& shape : kSignShapes) names += ' ' + std::string(shape.name);
  throw std::invalid_argument("--sign " + name + " is unknown; valid are" + names);
}

int train(const TrainCascadeOptions& o) {
  try {
    cv::setNumThreads(1);
    std::vector<SignShape> wanted;
    for (const std::string& name : o.signs) wanted.push_back(shape_of(name));
    if (wanted.empty()) wanted.assign(kSignShapes.begin(), kSignShapes.end());
    const auto train_scenes = scenes(o.seed, 0, o.images), held_out = scenes(o.seed, kHeldOut, kHeldOutImages);
    std::printf("%-14s %7s %7s %9s %28s\n", "sign", "stages", "stumps", "missed %", "false positives / 1e6 windows");
    for (const SignShape& shape : wanted) {
      TrainingParameters p;
      p.stages = o.stages;
      p.seed = o.seed;
      const std::string name(shape.name);
      const Cascade cascade =
          train_cascade(set_for(shape.sign, train_scenes, o.seed, 0, o.positives), p, [&](const Cascade& so_far) {
            std::fprintf(stderr, "%s: stage %zu has %zu stumps\n", name.c_str(), so_far.stages.size(),
                         so_far.stages.back().stumps.size());
          });
      const StageCurve curve =
          stage_curve(cascade, set_for(shape.sign, held_out, o.seed, kHeldOut, kHeldOutPositives), p.scale_factor);
      write_cascade(cascade, o.out / (name + ".xml"),
                    fmt::format("takt train cascade: sign {}, seed {}, {} positives, {} images", name, o.seed,
                                o.positives, o.images));
      write_curve((o.out / name).string(), curve);
      if (shape.colour != SignColour::any)
        write_layout(learn_layout(shape.sign, o.seed), o.out / (name + ".layout"),
                     fmt::format("takt train cascade: where sign {} is {}, seed {}", name,
                                 kColourNames[static_cast<size_t>(shape.colour)], o.seed));
      std::printf("%-14s %7zu %7zu %9.2f %28.3f\n", name.c_str(), cascade.stages.size(), cascade.features.size(),
                  curve.missed_pct.back(), curve.false_positives_per_million.back());
      std::fflush(stdout);
    }
    return kOk;
  } catch (const std::exception& error) {
    return refuse(error);
  }
}

int draw(const SignPictureOptions& o) {
  try {
    cv::RNG random(o.seed);
    const FlatSign flat = draw_flat(shape_of(o.sign).sign, random);
    cv::Mat3b plate(kFlatEdge_px, kFlatEdge_px, cv::Vec3b(150, 155, 155));
    const cv::Size size = flat.colour.size();
    flat.colour.copyTo(plate(cv::Rect({(plate.cols - size.width) / 2, (plate.rows - size.height) / 2}, size)),
                       flat.opaque);
    cv::resize(plate, plate, {o.size, o.size}, 0, 0, cv::INTER_AREA);
    require_written(picture::write_image(o.file, plate));
    return kOk;
  } catch (const std::exception& error) {
    return refuse(error);
  }
}

}  // namespace

void add_train(CLI::App& app, TrainOptions& options, int& exit_code) {
  TrainCascadeOptions& o = options.cascade;
  CLI::App* train_app = app.add_subcommand("train", "learns what nodes look for");
  train_app->require_subcommand(1);
  CLI::App* cascade =
      train_app->add_subcommand("cascade", "Haar cascades of traffic signs, from signs drawn by the program");
  cascade->add_option("--sign", o.signs, "class, several times for several (default all)");
  writes_folder(cascade->add_option("--out", o.out, "folder for NAME.xml, NAME.layout, NAME.csv, NAME.png (default .)"))
      ->check(CLI::ExistingDirectory);
  cascade->add_option("--stages", o.stages, "at most (default 16)")->check(CLI::Range(1, 200));
  cascade->add_option("--positives", o.positives, "windows with the sign (default 3000)")
      ->check(CLI::Range(50, 100000));
  cascade->add_option("--images", o.images, "images to take windows without it from (default 300)")
      ->check(CLI::Range(2, 5000));
  cascade->add_option("--seed", o.seed, "of signs, images and choices (default 1)");
  cascade->callback([&] { exit_code = train(o); });
  SignPictureOptions& p = options.picture;
  CLI::App* picture = train_app->add_subcommand("picture", "draws a sign, for a board of a simulated world");
  picture->add_option("sign", p.sign, "class")->required();
  writes_file(picture->add_option("file", p.file, "picture to write (.ppm, .png)"))->required();
  picture->add_option("--size", p.size, "px a side (default 128)")->check(CLI::Range(16, 1024));
  picture->add_option("--seed", p.seed, "of the sign's look (default 1)");
  picture->callback([&] { exit_code = draw(p); });
}

}  // namespace takt::command
