// SPDX-License-Identifier: Apache-2.0
#include "graph/tools/objects_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "nodes/object_detection/cut_out.hpp"
#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/object_list.hpp"
#include "nodes/object_detection/revisions.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "nodes/object_detection/tuning.hpp"
#include "nodes/picture/curves.hpp"
#include "nodes/picture/image_file.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/msg/ace/detections.hpp"

namespace takt::command {
namespace {

using object_detection::Attribute, object_detection::CascadeReferences, object_detection::DatabaseError,
    object_detection::DatabaseObject, object_detection::Detector, object_detection::DetectorParameters,
    object_detection::ErrorMaps, object_detection::ObjectList, object_detection::ReferenceView,
    object_detection::RocPoint, object_detection::Scene, object_detection::SceneParameters, object_detection::TestViews,
    object_detection::Tuning;
using object_detection::kHistogramStages, object_detection::learn_view, object_detection::make_scene,
    object_detection::publish_revision, object_detection::read_database;

ImageView<const uint8_t> view_of(const cv::Mat3b& image) { return {image.data, image.cols, image.rows, 3}; }

/// "bottle closed=true", attributes by name.
std::string label_of(const ObjectsOptions& o) {
  DatabaseObject entry;
  entry.name = o.name;
  for (const std::string& text : o.attributes) {
    const size_t equals = text.find('=');
    if (equals == 0 || equals >= text.size() - 1 || text.find(' ') != std::string::npos)
      throw DatabaseError("--attribute " + text + ": write ATTRIBUTE=VALUE, such as closed=true");
    entry.attributes.push_back({text.substr(0, equals), text.substr(equals + 1)});
  }
  std::sort(entry.attributes.begin(), entry.attributes.end(),
            [](const Attribute& a, const Attribute& b) { return a.name < b.name; });
  if (o.name.find_first_of(" #\t") != std::string::npos || o.name.empty())
    throw DatabaseError("object `" + o.name + "`: a name is one word without #");
  return entry.label();
}

/// Indices of the entry that was asked for, or of all.
std::vector<size_t> wanted(const std::vector<DatabaseObject>& database, const std::string& label) {
  std::vector<size_t> indices;
  std::string labels;
  for (size_t i = 0; i < database.size(); ++i) {
    labels += fmt::format(" `{}`", database[i].label());
    if (label.empty() || database[i].label() == label) indices.push_back(i);
  }
  if (indices.empty()) throw DatabaseError(fmt::format("there is no object `{}`; valid are{}", label, labels));
  return indices;
}

void list(const ObjectsOptions& o) {
  const auto database = read_database(o.database, o.size_px, TestViews::read);
  const CascadeReferences references = cascade_references(database, DetectorParameters{});
  fmt::print("{:>5} {:<32} {:>5} {:>10}   {:<22}\n", "class", "object", "views", "test views", "thresholds CH HOG CCH");
  for (size_t i = 0; i < database.size(); ++i) {
    fmt::print("{:>5} {:<32} {:>5} {:>10}  ", i, database[i].label(), database[i].views.size(),
               database[i].test_views.size());
    for (size_t s = 0; s < kHistogramStages; ++s)
      fmt::print(" {:.3f}{}", references[s].limits[i][0].threshold,
                 database[i].thresholds[s] || database[i].views[0].thresholds[s] ? "" : " (auto)");
    fmt::print("\n");
  }
}

void add(const ObjectsOptions& o) {
  const std::string label = label_of(o);
  std::vector<ReferenceView> views;  // all are read before anything is written
  for (const auto& file : o.images) views.push_back(learn_view(file, o.size_px));
  std::filesystem::create_directories(o.database);
  ObjectList entries(o.database);
  for (const ReferenceView& view : views) entries.add(label, view, o.test_view);
  entries.save(o.size_px);
  fmt::print("{}: {} {} of `{}` added\n", o.database.string(), views.size(), o.test_view ? "test views" : "views",
             label);
}

/// Maps of images from files, or of generated scenes.
std::vector<ErrorMaps> maps_of(const std::vector<std::filesystem::path>& files, const ObjectsOptions& o,
                               const CascadeReferences& references, size_t object,
                               const std::function<Scene(uint64_t)>& scene) {
  std::vector<ErrorMaps> maps;
  for (const auto& file : files)
    maps.push_back(
        error_maps(view_of(read_image(file, Channels::colour)), references, object, o.size_px, DetectorParameters{}));
  for (int i = 0; files.empty() && i < o.scenes; ++i)
    maps.push_back(
        error_maps(scene(static_cast<uint64_t>(i)).view(), references, object, o.size_px, DetectorParameters{}));
  return maps;
}

void write_roc(const std::string& file, const Tuning& tuning) {
  constexpr size_t kPoints = 14;
  std::vector<double> false_positive;
  picture::Curve detected{"detected % against false positive %", {}}, threshold{"threshold of the last stage", {}};
  for (size_t i = 0; i < kPoints; ++i) {
    const RocPoint& point = tuning.roc[i * (tuning.roc.size() - 1) / (kPoints - 1)];
    false_positive.push_back(std::round(1000 * point.false_positive) / 10);
    detected.values.push_back(100 * point.detected);
    threshold.values.push_back(point.threshold);
  }
  picture::write_curves(file, "false %", false_positive, {detected, threshold});
}

void tune(const ObjectsOptions& o) {
  const auto database = read_database(o.database, o.size_px, TestViews::read);
  const CascadeReferences references = cascade_references(database, DetectorParameters{});
  const std::vector<size_t> objects = wanted(database, o.object);
  if (objects.size() > 1 && (!o.positives.empty() || !o.negatives.empty() || !o.roc.empty()))
    throw DatabaseError("--positives, --negatives and --roc are of one object; name it with --object");
  ObjectList entries(o.database);
  fmt::print("{:<32} {:>6} {:>6} {:>6} {:>11} {:>17}\n", "object", "CH", "HOG", "CCH", "detected %",
             "false positives %");
  for (const size_t index : objects) {
    SceneParameters p;
    p.fewest_objects = p.most_objects = 1;
    p.occlusion_max = 0.4;
    const auto shows = [&](uint64_t i) { return make_scene(std::span(&database[index], 1), p, o.seed, i); };
    std::vector<DatabaseObject> others;
    for (const DatabaseObject& other : database)
      if (other.name != database[index].name && !other.test_views.empty()) others.push_back(other);
    const auto lacks = [&](uint64_t i) {
      SceneParameters without = p;
      without.fewest_objects = 0;
      without.most_objects = others.empty() ? 0 : 3;
      return make_scene(others, without, o.seed + 1, i);
    };
    const auto with = maps_of(o.positives, o, references, index, shows);
    const auto without = maps_of(o.negatives, o, references, index, lacks);
    const Tuning tuning = object_detection::tune(with, without, o.miss);
    const auto& t = tuning.thresholds;
    fmt::print("{:<32} {:6.3f} {:6.3f} {:6.3f} {:11.1f} {:17.1f}\n", database[index].label(), t[0], t[1], t[2],
               100 * tuning.chosen.detected, 100 * tuning.chosen.false_positive);
    if (!o.roc.empty()) write_roc(o.roc, tuning);
    entries.set_thresholds(database[index].label(), {t[0], t[1], t[2], database[index].thresholds[3]});
  }
  if (o.write) entries.save(o.size_px);
  else
    fmt::print("nothing was changed; --write puts these thresholds into {}\n", (o.database / "objects.txt").string());
}

/// Image with its detections, and the object's error in each window: dark is alike, bright is not.
cv::Mat3b map_picture(const cv::Mat3b& image, const ErrorMaps& maps, std::span<const Detection> boxes) {
  cv::Mat3b marked = image.clone();
  for (const Detection& box : boxes)
    cv::rectangle(marked, cv::Rect(cv::Point2f(box.x_px, box.y_px), cv::Size2f(box.width_px, box.height_px)),
                  {0, 255, 255}, 2);
  std::vector<cv::Mat> panels{marked};
  for (const std::vector<float>& error : maps.error) {
    const cv::Mat1f map(maps.grid.rows, maps.grid.columns, const_cast<float*>(error.data()));
    cv::Mat grey, panel;
    map.convertTo(grey, CV_8U, 255);
    cv::resize(grey, grey, image.size(), 0, 0, cv::INTER_NEAREST);
    cv::applyColorMap(grey, panel, cv::COLORMAP_VIRIDIS);
    panels.push_back(panel);
  }
  cv::Mat3b upper, lower, all;
  cv::hconcat(panels[0], panels[1], upper);
  cv::hconcat(panels[2], panels[3], lower);
  cv::vconcat(upper, lower, all);
  return all;
}

void test(const ObjectsOptions& o) {
  const auto database = read_database(o.database, o.size_px, TestViews::skip);
  const std::vector<size_t> objects = wanted(database, o.object);
  const CascadeReferences references = cascade_references(database, DetectorParameters{});
  if (!o.maps.empty()) std::filesystem::create_directories(o.maps);
  for (const auto& file : o.images) {
    const cv::Mat3b image = read_image(file, Channels::colour);
    Detector detector(image.cols, image.rows, database, DetectorParameters{});
    detector.run(view_of(image));
    std::vector<Detection> boxes(Detector::kMostDetections);
    boxes.resize(detector.detections(o.min_score, boxes));
    const auto of_others = [&](const Detection& box) {
      return std::find(objects.begin(), objects.end(), static_cast<size_t>(box.class_id)) == objects.end();
    };
    boxes.erase(std::remove_if(boxes.begin(), boxes.end(), of_others), boxes.end());
    fmt::print("{}: {} found\n", file.string(), boxes.size());
    for (const Detection& box : boxes)
      fmt::print("  {:<32} score {:.2f} at x {:.0f} y {:.0f}, {:.0f} x {:.0f} px\n",
                 database[static_cast<size_t>(box.class_id)].label(), box.score, box.x_px, box.y_px, box.width_px,
                 box.height_px);
    for (const size_t index : objects) {
      if (o.maps.empty()) break;
      std::vector<Detection> own;
      for (const Detection& box : boxes)
        if (static_cast<size_t>(box.class_id) == index) own.push_back(box);
      std::string name = file.stem().string() + "." + database[index].label() + ".png";
      std::replace(name.begin(), name.end(), ' ', '_');
      const ErrorMaps maps = error_maps(view_of(image), references, index, o.size_px, DetectorParameters{});
      require_written(picture::write_image(o.maps / name, map_picture(image, maps, own)));
    }
  }
}

void publish(const ObjectsOptions& o) {
  const std::string revision = publish_revision(o.database, o.size_px);
  fmt::print("{}\nto all running nodes: takt set object_detection:revision {}\n", revision, revision);
}

}  // namespace

void add_objects(CLI::App& app, ObjectsOptions& o, int& exit_code) {
  CLI::App* objects = app.add_subcommand("objects", "the database of known objects: what is in it, learning, tuning");
  objects->require_subcommand(1);
  const auto command = [&](const char* name, const char* doc, void (*act)(const ObjectsOptions&)) {
    CLI::App* sub = objects->add_subcommand(name, doc);
    reads_folder(sub->add_option("database", o.database, "folder with objects.txt"))->required();
    sub->add_option("--size", o.size_px, "edge of the views, px (default 48)")->check(CLI::Range(4, 254));
    sub->callback([&o, &exit_code, act] {
      try {
        cv::setNumThreads(1);
        act(o);
        exit_code = kOk;
      } catch (const std::exception& error) {
        exit_code = refuse(error);
      }
    });
    return sub;
  };
  const auto one_object = [&](CLI::App* sub) {
    sub->add_option("--object", o.object, "only this entry, such as \"bottle closed=true\"");
  };
  command("list", "entries with classes, views, thresholds", list);
  CLI::App* sub = command("add", "learns views of an object from images, cut out or before one colour", add);
  sub->add_option("name", o.name, "of the object")->required();
  reads_file(
      sub->add_option("images", o.images,
                      "each one view: transparent or exactly black where it is not the object, or before one colour"))
      ->required();
  sub->add_option("--attribute", o.attributes, "ATTRIBUTE=VALUE of the object in these images, repeatable");
  sub->add_flag("--test", o.test_view, "as test views, which only measurements use");
  sub = command("tune", "thresholds from images with and without an object", tune);
  one_object(sub);
  reads_file(sub->add_option("--positives", o.positives,
                             "images that show it somewhere (default: test views in made scenes)"));
  reads_file(
      sub->add_option("--negatives", o.negatives, "images that do not (default: made scenes with the other objects)"));
  sub->add_option("--scenes", o.scenes, "how many of each are made (default 30)")->check(CLI::Range(1, 10000));
  sub->add_option("--seed", o.seed, "of the made scenes (default 1)");
  sub->add_option("--miss", o.miss, "share of the positives that the first two stages may lose (default 0.05)")
      ->check(CLI::Range(0.0, 0.9));
  writes_file(sub->add_option("--roc", o.roc, "PNG: detected against false positives over the last stage's threshold"));
  sub->add_flag("--write", o.write, "puts the thresholds into objects.txt");
  sub = command("test", "what is found in images", test);
  reads_file(sub->add_option("images", o.images, "PNG, JPEG ..."))->required();
  one_object(sub);
  sub->add_option("--min-score", o.min_score, "smallest score (default 0.3)")->check(CLI::Range(0.0, 1.0));
  writes_folder(sub->add_option("--maps", o.maps,
                                "folder for pictures: the image and the errors of the three stages, per object"));
  command("publish", "copies the database as a revision that running nodes can change to", publish);
}

}  // namespace takt::command
