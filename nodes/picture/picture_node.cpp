// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "nodes/picture/draw.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace picture;

class PictureNode final : public Node {
 public:
  void setup(Setup& setup) override {
    directory_ = setup.output / directory_name_();
    left_.reserve(pair_.connected() ? pair_.capacity().pixels() * pair_.capacity().channels : 0);
    map_.reserve(disparity_.connected() ? disparity_.capacity().pixels() : 0);
    cells_.reserve(obstacles_.connected() ? obstacles_.capacity().pixels() : 0);
    if (motion_.connected()) track_.reserve(static_cast<size_t>(track_points_()));
  }

  void run(Job&) override {
    const StereoPair* pair = pair_.newest();
    if (pair && pair_.is_new() && keep(pair->left.items(), pair->width, pair->height, pair->channels, left_))
      left_width_ = pair->width, left_height_ = pair->height, left_channels_ = pair->channels;
    const DisparityMap* map = disparity_.newest();
    if (map && disparity_.is_new() && keep(map->disparity.items(), map->width, map->height, 1, map_))
      map_width_ = map->width, map_height_ = map->height, disparities_ = map->disparities;
    const Grid* grid = obstacles_.newest();
    if (grid && obstacles_.is_new() && keep(grid->cells.items(), grid->width, grid->height, 1, cells_))
      grid_width_ = grid->width, grid_height_ = grid->height;
    for (size_t i = 0; i < motion_.size(); ++i)
      if (motion_.is_new(i)) add({motion_[i].pose.x, motion_[i].pose.z, motion_[i].valid != 0});
  }

  void finish() override {
    std::error_code ignored;
    std::filesystem::create_directories(directory_, ignored);  // imwrite says whether it worked
    if (!left_.empty()) write("left.png", cv::Mat(left_height_, left_width_, CV_8UC(left_channels_), left_.data()));
    if (!map_.empty()) {
      cv::Mat image(map_height_, map_width_, CV_8UC3);
      draw_disparity({map_.data(), map_width_, map_height_}, disparities_, view(image));
      write("disparity.png", image);
    }
    if (!cells_.empty()) {
      const int scale = std::max(1, 600 / std::max(grid_width_, grid_height_));
      cv::Mat image(grid_height_ * scale, grid_width_ * scale, CV_8UC3);
      draw_grid({cells_.data(), grid_width_, grid_height_}, scale, view(image));
      write("obstacles.png", image);
    }
    if (!track_.empty()) {
      cv::Mat image(600, 600, CV_8UC3);
      draw_track(track_, view(image));
      write("track.png", image);
    }
  }

 private:
  /// Copies an array that is as long as its sizes say and fits the memory taken in setup.
  template <class T>
  static bool keep(std::span<const T> items, int width, int height, int channels, std::vector<T>& into) {
    const size_t wanted = static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
    if (items.size() != wanted || items.size() > into.capacity()) return false;
    into.assign(items.begin(), items.end());
    return true;
  }

  static Bgr view(cv::Mat& image) { return {image.data, image.cols, image.rows, 3}; }

  // A long run keeps every second point when the memory is full: the whole path stays visible.
  void add(const TrackPoint& point) {
    if (skip_-- > 0) return;
    skip_ = stride_ - 1;
    if (track_.size() == track_.capacity()) {
      for (size_t i = 0; 2 * i < track_.size(); ++i) track_[i] = track_[2 * i];
      track_.resize((track_.size() + 1) / 2);
      stride_ *= 2;
    }
    if (track_.size() < track_.capacity()) track_.push_back(point);
  }

  void write(const char* name, const cv::Mat& image) const {
    const std::string path = (directory_ / name).string();
    bool written = false;
    try {
      written = cv::imwrite(path, image);
    } catch (const cv::Exception&) {
    }
    if (!written)
      std::cerr << "picture: cannot write " << path << ": check that the directory exists and is writable\n";
  }

  Input<StereoPair> pair_{this, "pair", "its left image is written as left.png", Need::optional};
  Input<DisparityMap> disparity_{this, "disparity", "drawn as disparity.png", Need::optional};
  Input<Motion> motion_{this, "motion", "drawn as track.png: the camera's path from above", Need::optional};
  Input<Grid> obstacles_{this, "obstacles", "drawn as obstacles.png", Need::optional};
  Param<std::string> directory_name_{this, "directory", ".", "", "where to write, below the run's output directory"};
  Param<int> track_points_{this, "track_points", 20000, {16, 10000000}, "", "points of the path kept in memory"};

  std::filesystem::path directory_;
  std::vector<uint8_t> left_;
  std::vector<int16_t> map_, cells_;
  int left_width_ = 0, left_height_ = 0, left_channels_ = 0;
  int map_width_ = 0, map_height_ = 0, disparities_ = 0, grid_width_ = 0, grid_height_ = 0;
  std::vector<TrackPoint> track_;
  int stride_ = 1, skip_ = 0;
};

}  // namespace

void register_picture(NodeTypes& types) {
  types.add<PictureNode>("picture", Layer::storage,
                         "Sink: writes the last image, disparity, obstacle grid and the path as PNG at the end");
}

}  // namespace takt
