// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/evaluate.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "rt/msg/point.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::object_3d {
namespace {

constexpr size_t kMostPoints = 320 * 240, kMostObjects = 16;
const auto kWhole = [] { return true; };

double pct(size_t part, size_t whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Extents along the principal horizontal axes, as has them.
std::pair<double, double> extents_by_axes(const Scene& scene, std::span<const uint32_t> points) {
  const mapping_3d::Affine mount = mapping_3d::to_affine(scene.sensor_in_robot);
  std::vector<Eigen::Vector2d> flat;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const uint32_t i : points) {
    const Point& point = scene.points[i];
    const mapping_3d::Position p = mapping_3d::transformed(mount, static_cast<double>(point.x),
                                                           static_cast<double>(point.y), static_cast<double>(point.z));
    flat.emplace_back(p.x_m, p.y_m);
    mean += flat.back();
  }
  mean /= static_cast<double>(flat.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (Eigen::Vector2d& p : flat) p -= mean, covariance += p * p.transpose();
  const Eigen::Matrix2d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvectors();
  double extent[2];
  for (int a = 0; a < 2; ++a) {
    const auto [low, high] = std::minmax_element(flat.begin(), flat.end(), [&](const auto& p, const auto& q) {
      return axes.col(a).dot(p) < axes.col(a).dot(q);
    });
    extent[a] = axes.col(a).dot(*high - *low);
  }
  return {std::max(extent[0], extent[1]), std::min(extent[0], extent[1])};
}

/// What a solid measures, by attribute.
std::vector<std::pair<Attribute, double>> truth_of(const Part& part) {
  const bool box = part.solid == Solid::box;
  const double across = box ? part.width : part.length;
  const double area = box ? part.length * part.width : std::numbers::pi / 4 * part.length * part.length;
  return {{Attribute::length, std::max(part.length, across)},
          {Attribute::width, std::min(part.length, across)},
          {Attribute::height, part.height},
          {Attribute::area, area},
          {Attribute::volume, area * part.height}};
}

struct Errors {
  std::vector<double> ours, by_axes;  ///< in % of the truth, with their sign
};

double median_size(std::vector<double> errors) {
  for (double& e : errors) e = std::abs(e);
  return quantile(errors, 0.5);
}

AttributeError summary(const std::string& solid, Attribute attribute, const Errors& errors) {
  AttributeError e{solid, attribute, errors.ours.size()};
  std::vector<double> size = errors.ours;
  for (double& v : size) v = std::abs(v);
  e.bias_pct = quantile(errors.ours, 0.5);
  e.median_pct = quantile(size, 0.5);
  e.p95_pct = quantile(size, 0.95);
  e.largest_pct = quantile(size, 1);
  const auto within = std::count_if(size.begin(), size.end(), [](double v) { return v <= 5; });
  e.within_5_pct = pct(static_cast<size_t>(within), size.size());
  if (!errors.by_axes.empty()) e.by_axes_median_pct = median_size(errors.by_axes);
  return e;
}

Training only(const Training& training, const auto& wanted) {
  Training some{training.used, training.classes, {}};
  std::copy_if(training.samples.begin(), training.samples.end(), std::back_inserter(some.samples), wanted);
  return some;
}

/// The training without one class; later classes move up by one.
Training without(const Training& training, size_t left_out) {
  Training rest = only(training, [&](const Sample& s) { return s.class_id != left_out; });
  rest.classes.erase(rest.classes.begin() + static_cast<ptrdiff_t>(left_out));
  for (Sample& sample : rest.samples) sample.class_id -= sample.class_id > left_out;
  return rest;
}

size_t refused(Classifier& classifier, const Training& asked) {
  return static_cast<size_t>(std::count_if(asked.samples.begin(), asked.samples.end(), [&](const Sample& sample) {
    return classifier.classify(sample.attributes).class_id == kUnknown;
  }));
}

}  // namespace

MeasurementOfSolids measure_solids(const SceneParameters& p, uint64_t seed, size_t solids) {
  SceneParameters scenes = p;
  scenes.size_spread = 0;
  MeasurementOfSolids result;
  ObjectFinder finder(kMostPoints, kMostObjects, {}, nullptr);
  for (const Solid solid : {Solid::box, Solid::cylinder}) {
    const std::string name = solid == Solid::box ? "box" : "cylinder";
    std::map<Attribute, Errors> errors;
    cv::RNG sizes(seed + 1);
    for (size_t i = 0; i < solids; ++i) {
      Part part{solid};
      part.length = solid == Solid::box ? sizes.uniform(0.10, 0.28) : sizes.uniform(0.10, 0.22);
      part.width = solid == Solid::box ? sizes.uniform(0.10, 0.28) : 0;
      part.height = sizes.uniform(0.06, 0.25);
      const Scene scene = make_scene({{name, {part}, {70, 120, 170}}}, {0}, scenes, seed, i);
      const auto found = finder.run(scene.cloud(), {}, kWhole);
      ++result.solids;
      if (found.size() != 1) continue;
      ++result.found;
      const auto error = [](double is, double wanted) { return 100 * (is - wanted) / wanted; };
      for (const auto& [attribute, wanted] : truth_of(part))
        errors[attribute].ours.push_back(
            error(static_cast<double>(value(found[0].what.attributes, attribute)), wanted));
      const auto [length, width] = extents_by_axes(scene, finder.points_of(found[0]));
      const auto truth = truth_of(part);
      errors[Attribute::length].by_axes.push_back(error(length, truth[0].second));
      errors[Attribute::width].by_axes.push_back(error(width, truth[1].second));
    }
    for (const auto& [attribute, of] : errors) result.errors.push_back(summary(name, attribute, of));
  }
  return result;
}

Training make_training(const std::vector<Model>& models, const SceneParameters& scenes, uint64_t seed, size_t each) {
  Training training;
  for (size_t i = 0; i < kAttributes; ++i) training.used.push_back(static_cast<Attribute>(i));
  ObjectFinder finder(kMostPoints, kMostObjects, {}, nullptr);
  for (size_t kind = 0; kind < models.size(); ++kind) {
    training.classes.push_back(models[kind].name);
    for (uint64_t i = 0; i < each; ++i) {
      const Scene scene = make_scene(models, {kind}, scenes, seed, kind * each + i);
      const auto found = finder.run(scene.cloud(), {}, kWhole);
      if (found.size() == 1) training.samples.push_back({kind, found[0].what.attributes});
    }
  }
  return training;
}

std::string_view to_string(Method method) {
  switch (method) {
    case Method::nearest: return "nearest neighbour, rejecting";
    case Method::nearest_always: return "nearest neighbour, always answering";
    case Method::one_vs_rest: return "SVM, one against the rest";
    case Method::pairwise: return "SVM, pairwise";
  }
  return "";
}

std::unique_ptr<Classifier> make_classifier(Method method, const Training& training) {
  switch (method) {
    case Method::nearest: return std::make_unique<NearestNeighbour>(training, NearestParameters{});
    case Method::nearest_always:
      return std::make_unique<NearestNeighbour>(training, NearestParameters{.reject = false});
    case Method::one_vs_rest:
      return std::make_unique<SupportVectorMachines>(training, SvmParameters{SvmScheme::one_vs_rest});
    case Method::pairwise: return std::make_unique<SupportVectorMachines>(training, SvmParameters{SvmScheme::pairwise});
  }
  return nullptr;
}

std::vector<Classified> compare_classifiers(const Training& training, const Training& known, const Training& strange) {
  std::vector<Classified> all;
  for (const Method method : {Method::nearest, Method::nearest_always, Method::one_vs_rest, Method::pairwise}) {
    const auto classifier = make_classifier(method, training);
    Classified c{method};
    size_t right = 0, wrong = 0;
    std::vector<double> times_us;
    for (const Sample& sample : known.samples) {
      const int64_t begin = thread_cpu_ns();
      const int answer = classifier->classify(sample.attributes).class_id;
      times_us.push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-3);
      right += answer == static_cast<int>(sample.class_id);
      wrong += answer != kUnknown && answer != static_cast<int>(sample.class_id);
    }
    const size_t asked = known.samples.size();
    c.right_pct = pct(right, asked);
    c.wrong_pct = pct(wrong, asked);
    c.refused_pct = pct(asked - right - wrong, asked);
    c.time_us = quantile(times_us, 0.5);
    size_t left_out = 0;
    for (size_t k = 0; k < training.classes.size(); ++k)
      left_out += refused(*make_classifier(method, without(training, k)),
                          only(known, [&](const Sample& s) { return s.class_id == k; }));
    c.left_out_refused_pct = pct(left_out, asked);
    c.strange_refused_pct = pct(refused(*classifier, strange), strange.samples.size());
    all.push_back(c);
  }
  return all;
}

LabelledScenes label_scenes(const Training& training, const SceneParameters& scenes, uint64_t seed, size_t count) {
  std::vector<Model> models = table_models();
  const size_t known = models.size();
  for (const Model& model : strange_models()) models.push_back(model);
  const auto classifier = make_classifier(Method::nearest, training);
  ObjectFinder finder(kMostPoints, kMostObjects, {}, classifier.get());
  LabelledScenes result;
  std::vector<double> times_ms;
  cv::RNG random(seed + 7);
  for (uint64_t i = 0; i < count; ++i) {
    std::vector<size_t> kinds;
    for (int k = 0; k < 3; ++k) kinds.push_back(static_cast<size_t>(random.uniform(0, static_cast<int>(known))));
    if (i % 2 == 1)
      kinds[i / 2 % 3] = known + static_cast<size_t>(random.uniform(0, static_cast<int>(models.size() - known)));
    const Scene scene = make_scene(models, kinds, scenes, seed, i);
    const int64_t begin = thread_cpu_ns();
    const auto found = finder.run(scene.cloud(), {}, kWhole);
    times_ms.push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-6);
    std::vector<const FoundObject*> of(kinds.size(), nullptr);
    for (const FoundObject& object : found) {
      const int placed = scene.object[finder.points_of(object)[0]];
      if (placed >= 0) of[static_cast<size_t>(placed)] = &object;
    }
    size_t right = 0;
    for (size_t k = 0; k < kinds.size(); ++k) {
      const int wanted = kinds[k] < known ? static_cast<int>(kinds[k]) : kUnknown;
      const bool as_wanted = of[k] != nullptr && of[k]->answer.class_id == wanted;
      right += as_wanted;
      (wanted == kUnknown ? result.strange : result.objects) += 1;
      (wanted == kUnknown ? result.strange_refused : result.right) += as_wanted;
      result.found += wanted != kUnknown && of[k] != nullptr;
    }
    ++result.scenes;
    const auto named =
        std::count_if(found.begin(), found.end(), [](const FoundObject& o) { return o.answer.class_id != kUnknown; });
    const auto nameable = std::count_if(kinds.begin(), kinds.end(), [&](size_t kind) { return kind < known; });
    result.all_right += right == kinds.size() && named == nameable;
  }
  result.time_ms_p50 = quantile(times_ms, 0.5);
  result.time_ms_max = quantile(times_ms, 1);
  return result;
}

}  // namespace takt::object_3d
