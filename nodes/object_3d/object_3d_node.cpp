// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "nodes/object_3d/finder.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace object_3d;

Object3d message_of(const FoundObject& found) {
  const Description& d = found.what;
  const auto number = [](double v) { return static_cast<float>(v); };
  const auto of = [&](Attribute attribute) { return value(d.attributes, attribute); };
  return {static_cast<float>(found.answer.class_id),
          number(found.answer.score),
          number(d.outline.centre.x),
          number(d.outline.centre.y),
          number((d.base_z_m + d.top_z_m) / 2),
          number(d.outline.yaw_rad),
          of(Attribute::length),
          of(Attribute::width),
          of(Attribute::height),
          of(Attribute::area),
          of(Attribute::volume),
          number(d.mass_x_m),
          number(d.mass_y_m),
          number(d.mass_z_m),
          number(d.area_x_m),
          number(d.area_y_m),
          of(Attribute::shape_2),
          of(Attribute::shape_3),
          of(Attribute::fill),
          255 * of(Attribute::blue),
          255 * of(Attribute::green),
          255 * of(Attribute::red),
          static_cast<float>(found.on),
          static_cast<float>(found.beside)};
}

class Object3dNode final : public Node {
 public:
  void setup(Setup& setup) override {
    try {
      if (!training_().empty()) make_classifier(read_training(setup.directory / training_()));
    } catch (const TrainingError& error) {
      throw SetupError(error.what());
    }
    const auto objects = static_cast<uint32_t>(max_objects_());
    finder_.emplace(cloud_.capacity().count, objects, parameters(), classifier_.get());
    objects_.reserve({0, 0, 1, objects});
  }

  void changed() override {
    finder_->tune(parameters());
    const NearestParameters nearest{s_, t_q_, t_p_};
    if (nearest_ != nullptr) nearest_->tune(nearest);
  }

  void run(Job& job) override {
    const PointCloud* cloud = cloud_.newest();
    if (!cloud || !cloud_.is_new()) return job.no_result();
    Objects3d* out = objects_.loan();
    if (!out) return job.no_result();
    const auto reserve_ns = static_cast<int64_t>(reserve_() * 1e9);
    const auto found = finder_->run(
        {cloud->points.items(), cloud->colours.items(), cloud->camera, cloud->step_px, cloud->sensor_in_robot}, boxes(),
        [&] { return job.time_left_ns() > reserve_ns; });
    out->searched = static_cast<float>(finder_->searched());
    if (const auto& support = finder_->support()) {
      out->supported = 1;
      out->support_a = support->a, out->support_b = support->b, out->support_m = support->c;
    }
    for (const FoundObject& object : found) out->objects.push_back(message_of(object));
    objects_.send(cloud_.stamp_ns());
  }

  void remember(StateArchive&) override {}

 private:
  /// Those on the image that the cloud was made of.
  std::span<const Detection> boxes() const {
    for (size_t i = detections_.size(); i-- > 0;)
      if (detections_.stamp_ns(i) == cloud_.stamp_ns()) return detections_[i].boxes.items();
    return {};
  }

  FinderParameters parameters() const {
    if (seeds_() == static_cast<size_t>(SeedSource::boxes) && !detections_.connected())
      throw SetupError("seeds is boxes, which come with `detections`: connect it, or choose standing or colour");
    if (support_low_ >= support_high_)
      throw SetupError("support_low is " + support_low_.value_text() +
                       " m, must lie below support_high = " + support_high_.value_text() + " m");
    FinderParameters p;
    p.seeds = static_cast<SeedSource>(seeds_());
    p.colour = {hue_low_ / kDegree, hue_high_ / kDegree, saturation_low_, saturation_high_, value_low_, value_high_};
    p.components = {area_min_, area_max_};
    p.range_m = range_;
    p.needs_support = support_;
    p.support.low_m = support_low_, p.support.high_m = support_high_;
    p.clearance_m = clearance_;
    p.beside_m = beside_;
    p.segment.grow = {static_cast<float>(d_max_()), static_cast<float>(colour_max_()), static_cast<size_t>(i_max_())};
    p.segment.reach = {static_cast<float>(reach_radius_()), static_cast<float>(reach_up_()),
                       static_cast<float>(reach_down_())};
    p.segment.points_min = static_cast<size_t>(points_min_());
    return p;
  }

  void make_classifier(const Training& training) {
    if (classifier_kind_() == 0) {
      auto nearest = std::make_unique<NearestNeighbour>(training, NearestParameters{s_, t_q_, t_p_});
      nearest_ = nearest.get();
      classifier_ = std::move(nearest);
    } else {
      const auto scheme = classifier_kind_() == 1 ? SvmScheme::one_vs_rest : SvmScheme::pairwise;
      classifier_ = std::make_unique<SupportVectorMachines>(training, SvmParameters{scheme, svm_c_, svm_gamma_});
    }
  }

  static constexpr Fixed kTrainedAtStart{"trained at start"};
  static constexpr double kDegree = std::numbers::pi / 180;

  Input<PointCloud> cloud_{this, "cloud", "coloured points of a camera; the newest one is searched, once"};
  Input<Detections> detections_{this, "detections", "boxes on the cloud's image, for seeds: boxes; depth 4",
                                Need::optional};
  Output<Objects3d> objects_{this, "objects",
                             "class_id: index of the class in the training data; robot frame; the highest seed first"};

  Choice seeds_{this,
                "seeds",
                "standing",
                {"standing", "colour", "boxes"},
                "where regions begin: at everything on the support, at a colour, in the boxes of `detections`"};
  Param<double> hue_low_{this,          "hue_low", 335 * kDegree,
                         {0.0, 6.2832}, "rad",     "first hue of the colour; the defaults are skin"};
  Param<double> hue_high_{this, "hue_high", 25 * kDegree, {0.0, 6.2832}, "rad", "last hue; below hue_low: through red"};
  Param<double> saturation_low_{this, "saturation_low", 0.15, {0.0, 1.0}, "1", "of the colour"};
  Param<double> saturation_high_{this, "saturation_high", 0.75, {0.0, 1.0}, "1", "of the colour"};
  Param<double> value_low_{this, "value_low", 0.25, {0.0, 1.0}, "1", "of the colour"};
  Param<double> value_high_{this, "value_high", 1.0, {0.0, 1.0}, "1", "of the colour"};
  Param<double> area_min_{this,       "area_min", 100.0,
                          {1.0, 1e7}, "",         "pixels of the image that a component of the colour has"};
  Param<double> area_max_{this, "area_max", 20000.0, {1.0, 1e7}, "", "pixels that it has at most"};
  Param<double> range_{this, "range", 2.0, {0.2, 20.0}, "m", "farther from the camera nothing is looked for"};
  Param<bool> support_{this, "support", true, "", "objects stand on a level plane; its points are left out"};
  Param<double> support_low_{this,        "support_low", 0.3,
                             {-5.0, 5.0}, "m",           "height above which the support is looked for"};
  Param<double> support_high_{this, "support_high", 1.2, {-5.0, 5.0}, "m", "height below which it is looked for"};
  Param<double> clearance_{this, "clearance", 0.01, {0.0, 0.2}, "m", "lower points above the support belong to it"};
  Param<double> d_max_{this, "d_max", 0.02, {0.005, 0.5}, "m", "points at most so far apart hang together"};
  Param<double> colour_max_{
      this, "colour_max", 0.0, {0.0, 1.5}, "1", "chromaticities at most so far apart hang together; 0: any colours"};
  Param<int> i_max_{
      this, "i_max", 200'000, {1, 10'000'000}, "", "points whose neighbours are looked at, for one region"};
  Param<double> reach_radius_{this, "reach_radius", 0.4, {0.02, 5.0}, "m", "of the cylinder around a seed"};
  Param<double> reach_up_{this, "reach_up", 0.35, {0.0, 5.0}, "m", "of the cylinder above its seed"};
  Param<double> reach_down_{this, "reach_down", 0.6, {0.0, 5.0}, "m", "of the cylinder below its seed"};
  Param<int> points_min_{this, "points_min", 60, {3, 100'000}, "", "points of an object"};
  Param<double> beside_{this, "beside", 0.10, {0.0, 5.0}, "m", "gap between two things side by side"};
  Param<std::string> training_{this, "training", "", kPath, "file with what to learn from; empty: all are unknown"};
  Choice classifier_kind_{this,
                          "classifier",
                          "nearest",
                          {"nearest", "one_vs_rest", "pairwise"},
                          "nearest neighbour with rejection, or support vector machines",
                          kTrainedAtStart};
  Param<double> s_{this, "s", 1.0, {0.01, 100.0}, "1", "nearest: width of the likeness, in deviations"};
  Param<double> t_q_{this, "t_q", 0.1, {0.0, 1.0}, "1", "nearest: smallest likeness that is no unknown"};
  Param<double> t_p_{this, "t_p", 0.6, {0.0, 1.0}, "1", "nearest: smallest probability that is no unknown"};
  Param<double> svm_c_{this,           "svm_c", 1.0, {1e-3, 1e6}, "1", "machines: price of a sample on the wrong side",
                       kTrainedAtStart};
  Param<double> svm_gamma_{
      this, "svm_gamma", 0.0, {0.0, 1e3}, "1", "machines: of exp(-gamma d^2); 0: 1 / attributes", kTrainedAtStart};
  Param<int> max_objects_{this, "max_objects", 32, {1, 1000}, "", "at most so many", kSizesMemory};
  Param<double> reserve_{this, "reserve", 0.001, {0.0, 1.0}, "s", "with less time left than this the search ends"};

  std::unique_ptr<Classifier> classifier_;
  NearestNeighbour* nearest_ = nullptr;  ///< the classifier, if it is that
  std::optional<ObjectFinder> finder_;
};

}  // namespace

void register_object_3d(NodeTypes& types) {
  types.add<Object3dNode>("object_3d", Layer::perception, "Things on a support by region growing, attributes, classes");
}

}  // namespace takt
