// SPDX-License-Identifier: Apache-2.0
// How well objects are measured and told apart on generated scenes, and how well regions match labelled recordings.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "nodes/object_3d/scenes.hpp"

namespace takt::object_3d {

/// Error of one attribute over all solids, in % of the truth.
struct AttributeError {
  std::string solid;  ///< box or cylinder
  Attribute attribute;
  size_t solids = 0;
  double bias_pct = 0;                                                    ///< median with its sign
  double median_pct = 0, p95_pct = 0, largest_pct = 0, within_5_pct = 0;  ///< the last: share of the solids
  double by_axes_median_pct = -1;  ///< the same by principal axes; length and width alone, else -1
};

struct MeasurementOfSolids {
  std::vector<AttributeError> errors;
  size_t solids = 0, found = 0;  ///< found: exactly one object in the scene
};

/// Boxes of 0.10 .. 0.28 m and cylinders of 0.10 .. 0.22 m, 0.06 .. 0.25 m high, alone on the table, `solids` of each.
MeasurementOfSolids measure_solids(const SceneParameters& scenes, uint64_t seed, size_t solids);

/// `each` samples of each model, alone on the table: what classifiers learn from.
Training make_training(const std::vector<Model>& models, const SceneParameters& scenes, uint64_t seed, size_t each);

enum class Method : uint8_t { nearest, nearest_always, one_vs_rest, pairwise };
std::string_view to_string(Method method);
std::unique_ptr<Classifier> make_classifier(Method method, const Training& training);

/// Shares in %. Of the known: right, wrong class, unknown. Of the strange: unknown.
struct Classified {
  Method method;
  double right_pct = 0, wrong_pct = 0, refused_pct = 0;
  double left_out_refused_pct = 0;  ///< things of a class that the classifier was not taught, each class in turn
  double strange_refused_pct = 0;   ///< strange_models()
  double time_us = 0;               ///< CPU time of a decision, median
};

/// Trained with `training`, asked about samples of other scenes.
std::vector<Classified> compare_classifiers(const Training& training, const Training& known, const Training& strange);

struct LabelledScenes {
  size_t scenes = 0, all_right = 0;  ///< all three as they should be, and nothing else given a class
  size_t objects = 0, found = 0, right = 0;
  size_t strange = 0, strange_refused = 0;
  double time_ms_p50 = 0, time_ms_max = 0;  ///< CPU time of a whole cloud
};

/// Three kinds side by side, drawn anew in each scene, and in every second one a strange thing instead of one of them.
LabelledScenes label_scenes(const Training& training, const SceneParameters& scenes, uint64_t seed, size_t count);

/// A recorded scene against its labels.
struct MatchedScene {
  std::string name;
  size_t labelled = 0, found = 0;
  size_t matched = 0;       ///< labelled objects with a region at an overlap (intersection / union) of 0.5 or more
  double mean_overlap = 0;  ///< best overlap of each labelled object, mean
  double time_ms = 0;       ///< CPU time
};

/// Every scene of a folder as mOSD has them: NAME_rgb.png, NAME_depth_mm.png, NAME_label.png (0 none, 1..9 table, n /
/// 10 an object). The mount, which a robot knows, comes from the plane through the pixels labelled as table. Throws
/// std::runtime_error with the file for what cannot be read, or if there is none.
std::vector<MatchedScene> match_recordings(const std::filesystem::path& folder, double colour_max);

}  // namespace takt::object_3d
