// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/stereo_files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "hal/replay/frame_times.hpp"
#include "hal/replay/recording_layout.hpp"
#include "rt/image_file/image_list.hpp"

namespace takt::replay {
namespace {

namespace fs = std::filesystem;

tl::expected<ImageList, DeviceError> images(const std::string& id, const fs::path& directory) {
  try {
    ImageList list = list_images(directory);
    if (!list.files.empty()) return list;
    return device_error(id, directory.string() + ": holds no image (PNG, JPEG, PGM, PPM, BMP, TIFF)",
                        "put the frames there, numbered in order");
  } catch (const fs::filesystem_error& failed) {
    return device_error(id, directory.string() + ": " + failed.code().message(),
                        "the recording needs image_l/ and image_r/");
  }
}

bool parse_number(const std::string& word, double& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size() && std::isfinite(value);
}

/// One row "P0: a b c ..." of twelve finite numbers.
struct Projection {
  std::array<double, 12> p{};
  bool found = false;
};

tl::expected<CameraModel, DeviceError> read_calibration(const std::string& id, const RecordingLayout& layout) {
  const fs::path& file = layout.calibration;
  const std::string &left = layout.left_row, &right = layout.right_row;
  std::ifstream in(file);
  if (!in)
    return device_error(id, file.string() + ": cannot be opened",
                        "the recording needs it, with rows " + left + " and " + right);
  std::array<Projection, 2> camera;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    if (key != left && key != right) continue;
    Projection& row = camera[key == left ? 0 : 1];
    size_t count = 0;
    while (words >> word) {
      double value = 0;
      if (count >= 12 || !parse_number(word, value)) {
        return device_error(id,
                            file.string() + ":" + std::to_string(number) + ": value " + std::to_string(count + 1) +
                                " of " + key + " is `" + word + "`",
                            "give the twelve finite numbers of a 3 x 4 matrix");
      }
      row.p[count++] = value;
    }
    if (count != 12) {
      return device_error(id,
                          file.string() + ":" + std::to_string(number) + ": " + key + " has " + std::to_string(count) +
                              " values, needs 12",
                          "give the 3 x 4 matrix row by row");
    }
    row.found = true;
    const double focal = row.p[0];
    if (focal <= 0 || std::abs(row.p[5] - focal) > 1e-3 * focal || std::abs(row.p[0] - camera[0].p[0]) > 1e-3 * focal) {
      return device_error(id,
                          file.string() + ":" + std::to_string(number) + ": the focal lengths of " + key +
                              " are not positive and equal",
                          "record rectified images, or rectify them first");
    }
  }
  for (size_t i = 0; i < 2; ++i) {
    if (!camera[i].found)
      return device_error(id, file.string() + ": no row " + (i == 0 ? left : right),
                          "add it: twelve numbers, row-major");
  }
  const double baseline = (camera[0].p[3] - camera[1].p[3]) / camera[0].p[0];
  if (baseline <= 0) {
    return device_error(id, file.string() + ": the baseline is " + std::to_string(baseline) + " m",
                        "swap left and right, or correct " + right + " (0,3) = -f B");
  }
  return CameraModel{camera[0].p[0], camera[0].p[2], camera[0].p[6], baseline};
}

DeviceResult check_pairs(const std::string& id, const StereoFiles& files) {
  const auto folder = [](const std::vector<fs::path>& side) { return side.front().parent_path().string(); };
  if (files.left.size() != files.right.size())
    return device_error(id,
                        folder(files.left) + " holds " + std::to_string(files.left.size()) + " images, " +
                            folder(files.right) + " " + std::to_string(files.right.size()),
                        "complete the recording: each left image needs its right one");
  for (size_t i = 0; i < files.left.size(); ++i)
    if (files.left[i].stem() != files.right[i].stem())
      return device_error(id, files.left[i].string() + ": its partner is " + files.right[i].string(),
                          "name both images of a pair alike");
  return {};
}

/// Images whose names are their times, in ns: those that have a partner. The others are counted.
DeviceResult pair_by_time(const std::string& id, StereoFiles& files) {
  std::map<std::string, fs::path> right;
  for (const fs::path& file : files.right) right[file.stem().string()] = file;
  StereoFiles paired;
  int64_t first_ns = 0;
  for (const fs::path& file : files.left) {
    const std::string stem = file.stem().string();
    const auto partner = right.find(stem);
    if (partner == right.end()) continue;
    int64_t ns = 0;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), ns);
    if (error != std::errc{} || end != stem.data() + stem.size())
      return device_error(id, file.string() + ": its name is no time in ns", "name the images as EuRoC does");
    if (paired.left.empty()) first_ns = ns;
    paired.left.push_back(file);
    paired.right.push_back(partner->second);
    paired.stamp_ns.push_back(ns - first_ns);
  }
  if (paired.left.empty())
    return device_error(id, files.left.front().parent_path().string() + ": no image has a partner of its name",
                        "copy both cameras of one recording");
  const size_t alone = files.left.size() + files.right.size() - 2 * paired.left.size();
  if (alone > 0)
    files.left_out.push_back(files.left.front().parent_path().string() + ": " + std::to_string(alone) +
                             " images of one camera are left out: the other one has none of that time");
  files.left = std::move(paired.left), files.right = std::move(paired.right),
  files.stamp_ns = std::move(paired.stamp_ns);
  return {};
}

}  // namespace

tl::expected<StereoFiles, DeviceError> list_directory(const std::string& id, const fs::path& directory) {
  if (!fs::is_directory(directory))
    return device_error(id, directory.string() + ": no such directory",
                        "correct `directory`; a ${TAKT_DATA} in it is expanded");
  if (is_rgbd(directory))
    return device_error(id, directory.string() + ": a TUM RGB-D recording has colour and depth of one camera, no pairs",
                        "use a recording of two cameras; takt eval mapping --data reads depth images");
  const auto layout = find_layout(directory);
  if (!layout)
    return device_error(
        id, directory.string() + ": is no recording of stereo pairs",
        "known are image_l/ and image_r/, KITTI odometry (image_0/ ...), KITTI raw (image_00/data/ ...), "
        "EuRoC (mav0/cam0/data/ ...) and Middlebury (im0.png ...)");
  auto left = images(id, layout->left), right = images(id, layout->right);
  if (!left) return tl::unexpected(left.error());
  if (!right) return tl::unexpected(right.error());
  StereoFiles files;
  files.left_out = layout->left_out;
  for (const auto& [side, list] : {std::pair(&layout->left, &*left), std::pair(&layout->right, &*right)})
    if (std::string text = left_out_text(*side, *list); !text.empty()) files.left_out.push_back(std::move(text));
  files.left = std::move(left->files);
  files.right = std::move(right->files);
  if (const auto paired = layout->times.empty() ? pair_by_time(id, files) : check_pairs(id, files); !paired)
    return tl::unexpected(paired.error());
  files.rectified = !layout->calibration.empty();
  if (files.rectified) {
    auto camera = read_calibration(id, *layout);
    if (!camera) return tl::unexpected(camera.error());
    files.camera = *camera;
  }
  if (!layout->times.empty() && fs::exists(layout->times)) {
    auto times = read_frame_times(id, layout->times, files.left.size());
    if (!times) return tl::unexpected(times.error());
    files.stamp_ns = std::move(times->stamp_ns);
    if (!times->note.empty()) files.left_out.push_back(std::move(times->note));
  }
  return files;
}

std::optional<std::pair<fs::path, fs::path>> middlebury_pair(const fs::path& directory) {
  constexpr std::array<std::pair<const char*, const char*>, 4> kNames{
      {{"im2", "im6"}, {"im3", "im4"}, {"im0", "im1"}, {"view1", "view5"}}};
  for (const auto& [left, right] : kNames)
    for (const char* extension : {".png", ".ppm", ".pgm", ".jpg"}) {
      const fs::path a = directory / (std::string(left) + extension), b = directory / (std::string(right) + extension);
      if (fs::exists(a) && fs::exists(b)) return std::pair(a, b);
    }
  return std::nullopt;
}

tl::expected<void, std::string> check_complete(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return tl::unexpected(std::string("cannot be opened"));
  std::array<unsigned char, 8> head{};
  in.read(reinterpret_cast<char*>(head.data()), 8);
  if (in.gcount() < 3) return tl::unexpected(std::string("is shorter than any image"));
  in.clear();
  in.seekg(0, std::ios::end);
  const auto size = static_cast<int64_t>(in.tellg());
  const auto tail = [&](int64_t bytes) {
    std::string end(static_cast<size_t>(std::min(bytes, size)), '\0');
    in.seekg(size - static_cast<int64_t>(end.size()));
    in.read(end.data(), static_cast<std::streamsize>(end.size()));
    return end;
  };
  if (std::memcmp(head.data(), "\x89PNG\r\n\x1a\n", 8) == 0) {
    if (tail(8).substr(0, 4) != "IEND") return tl::unexpected(std::string("is a truncated PNG (no IEND at its end)"));
  } else if (head[0] == 0xFF && head[1] == 0xD8) {
    if (tail(64).find("\xFF\xD9") == std::string::npos)
      return tl::unexpected(std::string("is a truncated JPEG (no end marker)"));
  } else if (const std::string_view start(reinterpret_cast<const char*>(head.data()), 4);
             (head[0] != 'P' || head[1] < '2' || head[1] > '6') && !start.starts_with("BM") &&
             start != std::string_view("II*\0", 4) && start != std::string_view("MM\0*", 4)) {
    return tl::unexpected(std::string("is no PNG, JPEG, PGM, PPM, BMP or TIFF image"));
  }
  return {};
}

}  // namespace takt::replay
