// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <limits>
#include <optional>
#include <string>

#include "nodes/traffic_signs/distance.hpp"
#include "nodes/traffic_signs/tracks.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace traffic_signs;

class TrafficSignsNode final : public Node {
 public:
  void setup(Setup& setup) override {
    const Capacity& images = pair_.capacity();
    if (images.channels != 3)
      throw SetupError("`pair` has " + std::to_string(images.channels) +
                       " channel(s), must have three: signs are told by their colour first");
    try {
      detector_.emplace(static_cast<int>(images.width), static_cast<int>(images.height),
                        read_signs(setup.directory / signs_()), sign_parameters());
    } catch (const CascadeError& error) {
      throw SetupError(error.what());
    } catch (const std::invalid_argument& error) {
      throw SetupError(error.what());
    }
    tracks_.emplace(track_parameters());
    const Capacity most{0, 0, 1, Tracks::kMost};
    detections_.reserve(most);
    places_.reserve(most);
  }

  void changed() override {
    detector_->tune(sign_parameters());
    tracks_->tune(track_parameters());
  }

  void run(Job& job) override {
    const StereoPair* pair = pair_.newest();
    if (!pair || !pair_.is_new()) return job.no_result();
    const int64_t stamp = pair_.stamp_ns();
    const DisparityMap* map = disparity_.newest();
    if (map != nullptr && (disparity_.stamp_ns() != stamp || map->width != pair->width || map->height != pair->height))
      map = nullptr;
    const Image* roi = roi_.newest();
    const bool masked = roi != nullptr && roi_.stamp_ns() == stamp && roi->channels == 1;
    const auto reserve_ns = static_cast<int64_t>(reserve_() * 1e9), budget_ns = static_cast<int64_t>(budget_() * 1e9);
    const int64_t start_ns = job.time_left_ns();
    const auto may_go_on = [&] {
      const int64_t left = job.time_left_ns();
      return left > reserve_ns && start_ns - left < budget_ns;
    };
    if (!detector_->run(pair->left_view(), tracks_->expected(), masked ? roi->view() : ImageView<const uint8_t>(),
                        may_go_on))
      return job.no_result();
    tracks_->update(plausible(map), detector_->focused());
    if (!send(*pair, map, stamp)) job.no_result();
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, detector_, tracks_, crossing_level_); }

 private:
  SignDetectorParameters sign_parameters() const { return {scale_factor_, least_hits_, least_hits_alone_, least_fit_}; }
  TrackParameters track_parameters() const { return {confirm_, drop_, overlap_}; }

  /// Sightings without those whose size is known and no sign's.
  std::span<const Sighting> plausible(const DisparityMap* map) {
    kept_count_ = 0;
    for (const Sighting& sighting : detector_->sightings()) {
      const double z = map != nullptr ? meter_.distance_m(*map, sighting.box) : 0;
      if (z > 0 &&
          !has_size(detector_->signs()[sighting.sign], sighting.box, z, map->camera.focal_px, size_min_, size_max_))
        continue;
      kept_[kept_count_++] = sighting;
    }
    return {kept_.data(), kept_count_};
  }

  bool send(const StereoPair& pair, const DisparityMap* map, int64_t stamp) {
    Detections* found = detections_.connected() ? detections_.loan() : nullptr;
    PointCloud* places = places_.connected() ? places_.loan() : nullptr;
    DigitalState* crossing = crossing_.connected() ? crossing_.loan() : nullptr;
    if (found != nullptr) {
      found->image_width = pair.width;
      found->image_height = pair.height;
      found->searched = detector_->searched();
      found->boxes.resize(0);
    }
    if (places != nullptr) {
      places->camera = pair.camera;
      places->points.resize(0);
    }
    for (const Track& track : tracks_->tracks()) {
      if (!track.confirmed || track.missed > 0 || track.seen == 0) continue;
      const Box& box = track.last.box;
      if (found != nullptr) {
        const auto hits = static_cast<float>(track.last.hits);
        found->boxes.push_back({static_cast<float>(track.last.sign), static_cast<float>(box.x),
                                static_cast<float>(box.y), static_cast<float>(box.width),
                                static_cast<float>(box.height), hits / (hits + 3)});
      }
      if (places != nullptr) places->points.push_back(place(box, map));
    }
    if (found != nullptr) detections_.send(stamp);
    if (places != nullptr) places_.send(stamp);
    if (crossing != nullptr) {
      crossing->levels = tracks_->any_confirmed() ? 1 : 0;
      crossing->changed = crossing->levels ^ crossing_level_;
      crossing_level_ = crossing->levels;
      crossing_.send(stamp);
    }
    return (found != nullptr || !detections_.connected()) && (places != nullptr || !places_.connected()) &&
           (crossing != nullptr || !crossing_.connected());
  }

  /// The middle of a box in the frame of the left camera; not a number where the distance is not known.
  Point place(const Box& box, const DisparityMap* map) {
    const double z = map != nullptr ? meter_.distance_m(*map, box) : 0;
    if (!(z > 0)) {
      constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
      return {kUnknown, kUnknown, kUnknown};
    }
    const CameraModel& camera = map->camera;
    return {static_cast<float>((box.x + 0.5 * box.width - camera.cu_px) * z / camera.focal_px),
            static_cast<float>((box.y + 0.5 * box.height - camera.cv_px) * z / camera.focal_px), static_cast<float>(z)};
  }

  Input<StereoPair> pair_{this, "pair", "the left image is searched; three channels"};
  Input<DisparityMap> disparity_{this, "disparity", "of the pair, same stamp: distances and the check of sizes",
                                 Need::optional};
  Input<Image> roi_{this, "roi", "one channel, same stamp, any size: only where it is not 0", Need::optional};
  Output<Detections> detections_{this, "detections", "confirmed signs seen in this image; class_id: line in signs.txt"};
  Output<PointCloud> places_{this, "places", "of each box its middle in the left camera's frame; NaN: not known"};
  Output<DigitalState> crossing_{this, "crossing", "line 0: 1 while a confirmed sign is tracked"};

  Param<std::string> signs_{this, "signs", "signs", kPath, "folder with signs.txt and the cascades it names"};
  Param<double> scale_factor_{this, "scale_factor", 1.15, {1.05, 2.0}, "1", "from one scale to the next", kSizesMemory};
  Param<int> least_hits_{this, "least_hits", 2, {1, 100}, "", "windows that must agree on a sign with a colour layout"};
  Param<int> least_hits_alone_{this, "least_hits_alone", 5, {1, 100}, "", "windows that must agree on one without"};
  Param<double> least_fit_{this, "least_fit", 0.1, {-1.0, 1.0}, "1", "of a sighting to the sign's colour layout"};
  Param<int> confirm_{this, "confirm", 2, {1, 100}, "", "consecutive images with a sign until it counts"};
  Param<int> drop_{this, "drop", 3, {1, 100}, "", "consecutive images without it until it is forgotten"};
  Param<double> overlap_{this, "overlap",
                         0.3,  {0.05, 1.0},
                         "1",  "intersection over union of a sign's boxes from image to image, at least"};
  Param<double> size_min_{this, "size_min", 0.5, {0.0, 1.0}, "1", "of the nominal size, if the distance is known"};
  Param<double> size_max_{this, "size_max", 2.0, {1.0, 100.0}, "1", "of the nominal size, if the distance is known"};
  Param<double> budget_{this, "budget", 0.036, {0.001, 10.0}, "s", "longest search of an image"};
  Param<double> reserve_{this,       "reserve", 0.002,
                         {0.0, 1.0}, "s",       "with less time left than this the search ends and its best is sent"};

  std::optional<SignDetector> detector_;
  std::optional<Tracks> tracks_;
  DistanceMeter meter_{1024};
  std::array<Sighting, SignDetector::kMostSightings> kept_{};
  size_t kept_count_ = 0;
  uint32_t crossing_level_ = 0;
};

}  // namespace

void register_traffic_signs(NodeTypes& types) {
  types.add<TrafficSignsNode>("traffic_signs", Layer::perception,
                              "Traffic signs by Haar cascades, tracked, with distance and a crossing flag");
}

}  // namespace takt
