// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/grid_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "nodes/picture/image_file.hpp"
#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"

namespace takt::mapping_3d {
namespace {

constexpr double kOccupiedAbove = 0.65, kFreeBelow = 0.196;
constexpr uint8_t kWhite = 254, kGrey = 205, kBlack = 0;

uint8_t level_of(int16_t cell) {
  if (cell == kUnknown) return kGrey;
  const double probability = cell / 1000.0;
  return probability > kOccupiedAbove ? kBlack : probability < kFreeBelow ? kWhite : kGrey;
}

struct Meaning {
  double occupied_above, free_below;
  bool negate, scale;

  int16_t cell_of(uint8_t level) const {
    const double probability = (negate ? level : 255 - level) / 255.0;
    if (probability > occupied_above) return kOccupied;
    if (probability < free_below) return kFree;
    if (!scale) return kUnknown;
    return static_cast<int16_t>(std::lround(1000 * (probability - free_below) / (occupied_above - free_below)));
  }
};

/// Throws std::runtime_error with the key at fault.
template <class T>
T value(const YAML::Node& file, const char* key, const char* what) {
  try {
    return file[key].as<T>();
  } catch (const YAML::Exception&) {
    throw std::runtime_error(fmt::format("{} is missing or no {}", key, what));
  }
}

GridMap parse(const std::filesystem::path& path) {
  if (const std::string why = why_unreadable(path, kLargestText); !why.empty()) throw std::runtime_error(why);
  const YAML::Node file = YAML::LoadFile(path.string());
  if (!file.IsMap()) throw std::runtime_error("a map with the keys image, resolution, origin is expected");
  GridMap map;
  map.cell_m = value<double>(file, "resolution", "number");
  if (!(map.cell_m > 0)) throw std::runtime_error(fmt::format("resolution is {}, must be above 0 m", map.cell_m));
  const auto origin = value<std::vector<double>>(file, "origin", "list [x, y, yaw]");
  if (origin.size() != 3) throw std::runtime_error("origin has not three numbers [x, y, yaw]");
  map.corner = {origin[0], origin[1], origin[2]};
  const std::string mode = file["mode"] ? value<std::string>(file, "mode", "word") : "trinary";
  if (mode != "trinary" && mode != "scale")
    throw std::runtime_error(fmt::format("mode is {}, must be trinary or scale", mode));
  const Meaning meaning{value<double>(file, "occupied_thresh", "number"), value<double>(file, "free_thresh", "number"),
                        value<int>(file, "negate", "0 or 1") != 0, mode == "scale"};
  if (!(meaning.free_below < meaning.occupied_above))
    throw std::runtime_error("free_thresh must lie below occupied_thresh");
  const std::filesystem::path picture = path.parent_path() / value<std::string>(file, "image", "file name");
  const cv::Mat image = read_image(picture, Channels::grey);
  map.width = image.cols, map.height = image.rows;
  map.cells.reserve(static_cast<size_t>(image.cols) * static_cast<size_t>(image.rows));
  for (int y = image.rows; y-- > 0;)
    for (int x = 0; x < image.cols; ++x) map.cells.push_back(meaning.cell_of(image.at<uint8_t>(y, x)));
  return map;
}

}  // namespace

tl::expected<void, std::string> write_grid(const std::filesystem::path& yaml, const GridMap& map) {
  std::filesystem::path picture = yaml;
  picture.replace_extension(".png");
  cv::Mat image(map.height, map.width, CV_8UC1);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) image.at<uint8_t>(map.height - 1 - y, x) = level_of(map.view().at(x, y));
  if (const auto done = picture::write_image(picture, image); !done) return tl::unexpected(done.error().what);
  const auto done =
      write_file(yaml, fmt::format("image: {}\nmode: trinary\nresolution: {}\norigin: [{}, {}, {}]\nnegate: 0\n"
                                   "occupied_thresh: {}\nfree_thresh: {}\n",
                                   picture.filename().string(), map.cell_m, map.corner.x_m, map.corner.y_m,
                                   map.corner.theta_rad, kOccupiedAbove, kFreeBelow));
  if (!done) return tl::unexpected(done.error().what);
  return {};
}

tl::expected<GridMap, std::string> read_grid(const std::filesystem::path& yaml) {
  try {
    return parse(yaml);
  } catch (const std::exception& problem) {
    return tl::unexpected(yaml.string() + ": " + problem.what());
  }
}

}  // namespace takt::mapping_3d
