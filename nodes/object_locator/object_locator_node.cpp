// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <vector>

#include "nodes/mapping_3d/head_at.hpp"
#include "nodes/object_detection/database.hpp"
#include "nodes/semantic/box_locator.hpp"
#include "nodes/semantic/reports.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using mapping_3d::Position;
using semantic::set_text;

/// An entry of the database as it is reported.
struct Class {
  ObjectName name;
  std::vector<ObjectAttribute> attributes;
};

Class class_of(const object_detection::DatabaseObject& entry) {
  constexpr size_t kMostAttributes = 8;  // that ObjectReports has room for
  Class known{};
  bool fits = set_text(entry.name, known.name.type) && entry.attributes.size() <= kMostAttributes;
  for (const auto& attribute : entry.attributes) {
    ObjectAttribute& said = known.attributes.emplace_back();
    fits = fits && set_text(attribute.name, said.name) && set_text(attribute.value, said.value);
  }
  if (!fits)
    throw SetupError(
        fmt::format("database: object `{}` cannot be reported: names and values may have {} characters, an "
                    "object {} attributes",
                    entry.label(), sizeof(ObjectName::type) - 1, kMostAttributes));
  return known;
}

class ObjectLocatorNode final : public Node {
 public:
  void setup(Setup& setup) override {
    try {
      for (const auto& entry : object_detection::read_classes(setup.directory / database_()))
        classes_.push_back(class_of(entry));
    } catch (const object_detection::DatabaseError& error) {
      throw SetupError(error.what());
    }
    locator_.emplace(disparity_.capacity().pixels(), semantic::BoxLocatorParameters{share_, valid_min_, agree_});
    reports_.reserve({0, 0, 1, detections_.capacity().count});
  }

  void changed() override { locator_->tune({share_, valid_min_, agree_}); }

  void run(Job& job) override {
    const Detections* detections = detections_.newest();
    if (!detections || !detections_.is_new()) return job.no_result();
    const int64_t stamp_ns = detections_.stamp_ns();
    const DisparityMap* map = map_nearest_to(stamp_ns);
    const auto camera = camera_at(stamp_ns);
    ObjectReports* reports = map && camera ? reports_.loan() : nullptr;
    if (!reports) return job.no_result();
    const semantic::DisparityView view{
        map->view(), map->fraction.size == map->disparity.size ? map->fraction_view() : ImageView<const uint8_t>(),
        map->camera};
    for (const Detection& detection : detections->boxes.items()) report(detection, view, *camera, *reports);
    reports_.send(stamp_ns);
  }

  void remember(StateArchive&) override {}

 private:
  /// Null: none is near enough, or it is not as large as it says.
  const DisparityMap* map_nearest_to(int64_t stamp_ns) const {
    size_t nearest = 0;
    const auto apart_ns = [&](size_t i) { return std::abs(disparity_.stamp_ns(i) - stamp_ns); };
    for (size_t i = 1; i < disparity_.size(); ++i)
      if (apart_ns(i) < apart_ns(nearest)) nearest = i;
    if (disparity_.empty() || apart_ns(nearest) > kFarthest_ns) return nullptr;
    const DisparityMap& map = disparity_[nearest];
    const bool whole = map.width > 0 && map.height > 0 &&
                       map.disparity.size == static_cast<size_t>(map.width) * static_cast<size_t>(map.height);
    return whole && map.camera.focal_px > 0 ? &map : nullptr;
  }

  /// In the robot frame, none: not known.
  std::optional<mapping_3d::Affine> camera_at(int64_t stamp_ns) const {
    const StereoPair* pair = pair_.newest();
    if (!pair) return std::nullopt;
    const Transform& t = pair->sensor_in_robot;
    if (!mapping_3d::is_known(t)) return std::nullopt;
    if (!head_.connected()) return mapping_3d::to_affine(t);
    const auto head = mapping_3d::head_at(head_, stamp_ns, kFarthest_ns);
    if (!head) return std::nullopt;
    return mapping_3d::to_affine(mapping_3d::turned_by_head(t, head->pan_rad, head->tilt_rad));
  }

  void report(const Detection& box, const semantic::DisparityView& view, const mapping_3d::Affine& camera,
              ObjectReports& out) {
    if (!(box.class_id >= 0) || box.class_id >= static_cast<float>(classes_.size())) return;
    const auto front = locator_->locate(box.x_px, box.y_px, box.width_px, box.height_px, view);
    if (!front) return;
    Position place = transformed(camera, front->x_m, front->y_m, front->z_m);
    const double right = place.x_m - camera.t[0], ahead = place.y_m - camera.t[1], range = std::hypot(right, ahead);
    if (!(range > 0) || range < range_min_ || range > range_max_) return;
    place.x_m += half_depth_ * right / range;
    place.y_m += half_depth_ * ahead / range;
    const Class& known = classes_[static_cast<size_t>(box.class_id)];
    if (is_there(known.name, place, out) || !out.names.push_back(known.name)) return;
    out.places.push_back({static_cast<float>(place.x_m), static_cast<float>(place.y_m), static_cast<float>(place.z_m),
                          0, box.score, static_cast<float>(known.attributes.size())});
    for (const ObjectAttribute& attribute : known.attributes) out.attributes.push_back(attribute);
  }

  /// An object of that type, of a better box (they come best first), at that place.
  bool is_there(const ObjectName& name, const Position& place, const ObjectReports& reported) const {
    for (uint32_t i = 0; i < reported.names.size; ++i)
      if (std::strcmp(reported.names[i].type, name.type) == 0 &&
          std::hypot(reported.places[i].x_m - place.x_m, reported.places[i].y_m - place.y_m) < apart_)
        return true;
    return false;
  }

  static constexpr int64_t kFarthest_ns = 250'000'000;  ///< from an image to its disparities (R-14.3)

  Input<Detections> detections_{this, "detections", "boxes in the left image; class_id as `database` counts"};
  Input<DisparityMap> disparity_{this, "disparity", "the one nearest in time is used, at most 0.25 s away; depth 4"};
  Input<StereoPair> pair_{this, "pair", "of the same camera: where it is mounted"};
  Input<HeadState> head_{this, "head", "where the camera sits on the head; depth 16", Need::optional};
  Output<ObjectReports> reports_{this, "reports", "type, attributes, score and place of each, robot frame"};
  Param<std::string> database_{this, "database", "objects", kPath,
                               "folder with objects.txt, as object_detection has it"};
  Param<double> share_{this,       "share", semantic::BoxLocatorParameters{}.share,
                       {0.1, 1.0}, "1",     "of a box in each direction, about its middle, that counts"};
  Param<double> valid_min_{this,       "valid_min", semantic::BoxLocatorParameters{}.valid_min,
                           {0.0, 1.0}, "1",         "of the pixels there must have a disparity"};
  Param<double> agree_{
      this,
      "agree",
      semantic::BoxLocatorParameters{}.agree,
      {0.0, 1.0},
      "1",
      "of the disparities there: the nearest that are so many near one depth are the object's; 0: the median of all"};
  Param<double> range_min_{this,        "range_min", 0.0,
                           {0.0, 50.0}, "m",         "nor are nearer ones: what is larger than its box"};
  Param<double> range_max_{this, "range_max", 5.0, {0.5, 50.0}, "m", "farther objects are not reported"};
  Param<double> apart_{this, "apart",
                       0.0,  {0.0, 5.0},
                       "m",  "boxes of one type that are nearer to each other are of one object: the best is reported"};
  Param<double> half_depth_{this,       "half_depth", 0.0,
                            {0.0, 2.0}, "m",          "how far behind its front an object's middle lies"};

  std::vector<Class> classes_;
  std::optional<semantic::BoxLocator> locator_;
};

}  // namespace

void register_object_locator(NodeTypes& types) {
  types.add<ObjectLocatorNode>("object_locator", Layer::processing,
                               "Where detected objects are: boxes joined with the disparities of their stamp");
}

}  // namespace takt
