// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/ground_map/terrain.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/draw.hpp"
#include "nodes/picture/image_file.hpp"
#include "nodes/picture/kept.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace picture;

class PictureNode final : public Node {
 public:
  void setup(Setup& setup) override {
    output_ = setup.output;
    left_.reserve(elements_of(pair_));
    ground_left_.reserve(elements_of(ground_pair_));
    mask_kept_.reserve(elements_of(mask_));
    map_.reserve(elements_of(disparity_));
    for (const Drawn& drawn : grids_) drawn.cells->reserve(elements_of(*drawn.port));
    for (const auto& [port, cloud] : clouds_)
      if (port->connected()) cloud->reserve(port->capacity().count);
    if (detections_.connected()) boxes_.reserve(detections_.capacity().count);
    if (motion_.connected()) track_.reserve(static_cast<size_t>(track_points_()));
  }

  void run(Job&) override {
    keep_left();
    keep_ground_mask();
    const DisparityMap* map = disparity_.newest();
    if (map && disparity_.is_new() && map_.keep(map->disparity.items(), map->width, map->height))
      disparities_ = map->disparities;
    for (const Drawn& drawn : grids_) keep_grid(*drawn.port, *drawn.cells);
    for (const auto& [port, cloud] : clouds_)
      if (port->newest() && port->is_new()) cloud->keep(*port->newest());
    if (terrain_.newest()) kind_ = terrain_.newest()->kind;
    for (size_t i = 0; i < motion_.size(); ++i)
      if (motion_.is_new(i)) track_.add({motion_[i].pose.x, motion_[i].pose.z, motion_[i].valid != 0});
  }

  void finish() override {
    directory_ = output_ / directory_name_();
    std::error_code ignored;
    std::filesystem::create_directories(directory_, ignored);  // imwrite says whether it worked
    if (!left_.empty()) {
      cv::Mat image = colour_image(left_.view());
      draw_detections(boxes_, view(image));
      write("left.png", image);
    }
    if (!mask_kept_.empty()) {
      cv::Mat image = colour_image(ground_left_.view());
      draw_mask(mask_kept_.view(), view(image));
      write("ground.png", image);
    }
    if (!map_.empty()) {
      cv::Mat image(map_.view().height, map_.view().width, CV_8UC3);
      draw_disparity(map_.view(), disparities_, view(image));
      write("disparity.png", image);
    }
    for (const Drawn& drawn : grids_) write_grid(drawn);
    const cloud::CloudView clouds[] = {coloured_cloud_.view(), match_cloud_.view()};
    if (!clouds[0].points.empty() || !clouds[1].points.empty()) write("laser.png", draw_clouds(clouds));
    if (!track_.points().empty()) {
      cv::Mat image(600, 600, CV_8UC3);
      draw_track(track_.points(), view(image));
      write("track.png", image);
    }
  }

  /// What the next messages bring anew is left out.
  void remember(StateArchive& archive) override { TAKT_STATE(archive, kind_, track_, mask_stamp_ns_); }

 private:
  static size_t elements_of(const InputPort& port) {
    return port.connected() ? port.capacity().pixels() * port.capacity().channels : 0;
  }

  void keep_left() {
    if (!pair_.is_new()) return;
    const ImageWithBoxes found = newest_with_boxes(pair_, detections_);
    if (!keep(pair_[found.image], left_)) return;
    boxes_.clear();
    if (found.boxes) keep_boxes(detections_[*found.boxes], boxes_);
  }

  /// The newest mask whose image is latched with it.
  void keep_ground_mask() {
    for (size_t i = mask_.size(); i-- > 0 && mask_.stamp_ns(i) > mask_stamp_ns_;) {
      const auto image = with_stamp(ground_pair_, mask_.stamp_ns(i));
      if (!image || ground_pair_[*image].width != mask_[i].width || ground_pair_[*image].height != mask_[i].height ||
          mask_[i].channels != 1)
        continue;
      if (keep(ground_pair_[*image], ground_left_) &&
          mask_kept_.keep(mask_[i].pixels.items(), mask_[i].width, mask_[i].height))
        mask_stamp_ns_ = mask_.stamp_ns(i);
      return;
    }
  }

  static bool keep(const StereoPair& pair, KeptImage<uint8_t>& into) {
    return into.keep(pair.left.items(), pair.width, pair.height, pair.channels);
  }

  static void keep_grid(const Input<Grid>& port, KeptImage<int16_t>& into) {
    const Grid* grid = port.newest();
    if (grid && port.is_new()) into.keep(grid->cells.items(), grid->width, grid->height);
  }

  static Bgr view(cv::Mat& image) { return {image.data, image.cols, image.rows, 3}; }

  static cv::Mat colour_image(ImageView<const uint8_t> kept) {
    cv::Mat image(kept.height, kept.width, CV_8UC3);
    draw_image(kept, view(image));
    return image;
  }

  /// An input, what of it is kept, and where it is written.
  struct Drawn {
    const Input<Grid>* port;
    KeptImage<int16_t>* cells;
    const char* file;
  };

  void write_grid(const Drawn& drawn) const {
    const ImageView<const int16_t> cells = drawn.cells->view();
    if (!cells.data || cells.width == 0) return;
    const int scale = std::max(1, 600 / std::max(cells.width, cells.height));
    cv::Mat image(cells.height * scale, cells.width * scale, CV_8UC3);
    draw_grid(cells, scale, view(image));
    if (drawn.port == &ground_ && kind_ && *kind_ < ground_map::kTerrainNames.size())
      cv::putText(image, std::string(ground_map::kTerrainNames[*kind_]), {10, image.rows - 12},
                  cv::FONT_HERSHEY_SIMPLEX, 0.8, {0, 0, 200}, 2);
    write(drawn.file, image);
  }

  void write(const char* name, const cv::Mat& image) const {
    const std::string path = (directory_ / name).string();
    if (const auto done = write_image(path, image); !done)
      std::cerr << "picture: " << done.error().what << "; check that the folder exists, is writable and has room\n";
  }

  Input<StereoPair> pair_{this, "pair", "its left image is written as left.png", Need::optional};
  Input<Detections> detections_{this, "detections", "boxes on the left image of their stamp; depth 4, and 4 for pair",
                                Need::optional};
  Input<DisparityMap> disparity_{this, "disparity", "drawn as disparity.png", Need::optional};
  Input<Motion> motion_{this, "motion", "drawn as track.png: the camera's path from above", Need::optional};
  Input<Grid> obstacles_{this, "obstacles", "drawn as obstacles.png", Need::optional};
  Input<StereoPair> ground_pair_{this, "ground_pair", "images that mask belongs to; depth 4", Need::optional};
  Input<Image> mask_{this, "mask", "ground: drawn over the left image of its stamp as ground.png", Need::optional};
  Input<Grid> ground_{this, "ground", "drawn as ground_map.png", Need::optional};
  Input<takt::Terrain> terrain_{this, "terrain", "its kind is written on ground_map.png", Need::optional};
  Input<Grid> merged_{this, "merged", "obstacles with what else is known: merged.png", Need::optional};
  Input<Grid> traversability_{this, "traversability", "drawn as traversability.png", Need::optional};
  Input<PointCloud> coloured_{this, "coloured", "laser points in a camera's colours: left in laser.png",
                              Need::optional};
  Input<PointCloud> match_{this, "match", "the same, red to green by how well they match: right in laser.png",
                           Need::optional};
  Param<std::string> directory_name_{this, "directory", ".", "", "where to write, below the run's output directory"};
  Param<int> track_points_{this,        "track_points", 20000, {16, 10000000}, "", "points of the path kept in memory",
                           kSizesMemory};

  std::filesystem::path output_, directory_;
  KeptImage<uint8_t> left_, ground_left_, mask_kept_;
  KeptImage<int16_t> map_, obstacle_cells_, ground_cells_, merged_cells_, traversability_cells_;
  const Drawn grids_[4] = {{&obstacles_, &obstacle_cells_, "obstacles.png"},
                           {&ground_, &ground_cells_, "ground_map.png"},
                           {&merged_, &merged_cells_, "merged.png"},
                           {&traversability_, &traversability_cells_, "traversability.png"}};
  KeptCloud coloured_cloud_, match_cloud_;
  const std::pair<const Input<PointCloud>*, KeptCloud*> clouds_[2] = {{&coloured_, &coloured_cloud_},
                                                                      {&match_, &match_cloud_}};
  std::optional<uint8_t> kind_;
  std::vector<Detection> boxes_;
  KeptTrack track_;
  int disparities_ = 0;
  int64_t mask_stamp_ns_ = INT64_MIN;
};

}  // namespace

void register_picture(NodeTypes& types) {
  types.add<PictureNode>(
      "picture", Layer::storage,
      "Sink: writes the last images, maps, clouds, ground mask, detections and the path as PNG at the end");
}

}  // namespace takt
