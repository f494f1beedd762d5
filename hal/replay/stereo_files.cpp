// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/stereo_files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

namespace takt::replay {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".pgm" ||
         extension == ".ppm";
}

tl::expected<std::vector<fs::path>, DeviceError> images(const std::string& id, const fs::path& directory) {
  std::error_code failed;
  std::vector<fs::path> found;
  for (fs::directory_iterator it(directory, failed), end; !failed && it != end; it.increment(failed)) {
    if (is_image(it->path())) found.push_back(it->path());
  }
  if (failed)
    return device_error(id, directory.string() + ": " + failed.message(), "the recording needs image_l/ and image_r/");
  if (found.empty())
    return device_error(id, directory.string() + ": holds no PNG, JPEG, PGM or PPM image",
                        "put the frames there, named in order");
  std::sort(found.begin(), found.end());
  return found;
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

tl::expected<CameraModel, DeviceError> read_calibration(const std::string& id, const fs::path& file) {
  std::ifstream in(file);
  if (!in)
    return device_error(id, file.string() + ": cannot be opened",
                        "the recording needs calib.txt with rows P0: and P1:");
  std::array<Projection, 2> camera;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    if (key != "P0:" && key != "P1:") continue;
    Projection& row = camera[key == "P0:" ? 0 : 1];
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
      return device_error(id, file.string() + ": no row P" + std::to_string(i) + ":",
                          "add it: twelve numbers, row-major");
  }
  const double baseline = (camera[0].p[3] - camera[1].p[3]) / camera[0].p[0];
  if (baseline <= 0) {
    return device_error(id, file.string() + ": the baseline is " + std::to_string(baseline) + " m",
                        "swap left and right, or correct P1(0,3) = -f B");
  }
  return CameraModel{camera[0].p[0], camera[0].p[2], camera[0].p[6], baseline};
}

tl::expected<std::vector<int64_t>, DeviceError> read_times(const std::string& id, const fs::path& file, size_t frames) {
  std::vector<int64_t> stamps;
  std::ifstream in(file);
  std::string line;
  double first = 0;
  for (int number = 1; std::getline(in, line); ++number) {
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    if (line.empty()) continue;
    double seconds = 0;
    if (!parse_number(line, seconds))
      return device_error(id, file.string() + ":" + std::to_string(number) + ": `" + line + "` is no number",
                          "one time in seconds a line");
    if (stamps.empty()) first = seconds;
    const int64_t stamp = std::llround((seconds - first) * 1e9);
    if (!stamps.empty() && stamp <= stamps.back())
      return device_error(id, file.string() + ":" + std::to_string(number) + ": time does not rise",
                          "sort the recording");
    stamps.push_back(stamp);
  }
  if (stamps.size() != frames) {
    return device_error(
        id, file.string() + ": " + std::to_string(stamps.size()) + " times for " + std::to_string(frames) + " frames",
        "one line per frame, or delete the file and give `rate`");
  }
  return stamps;
}

}  // namespace

tl::expected<StereoFiles, DeviceError> list_directory(const std::string& id, const fs::path& directory) {
  if (!fs::is_directory(directory))
    return device_error(id, directory.string() + ": no such directory",
                        "correct `directory`; a ${TAKT_DATA} in it is expanded");
  auto left = images(id, directory / "image_l"), right = images(id, directory / "image_r");
  if (!left) return tl::unexpected(left.error());
  if (!right) return tl::unexpected(right.error());
  if (left->size() != right->size()) {
    return device_error(id,
                        directory.string() + ": image_l holds " + std::to_string(left->size()) + " images, image_r " +
                            std::to_string(right->size()),
                        "complete the recording: each left image needs its right one");
  }
  for (size_t i = 0; i < left->size(); ++i) {
    if ((*left)[i].stem() != (*right)[i].stem()) {
      return device_error(id, (*left)[i].string() + ": its partner is " + (*right)[i].string(),
                          "name both images of a pair alike");
    }
  }
  auto camera = read_calibration(id, directory / "calib.txt");
  if (!camera) return tl::unexpected(camera.error());
  StereoFiles files{std::move(*left), std::move(*right), {}, *camera};
  if (fs::exists(directory / "times.txt")) {
    auto stamps = read_times(id, directory / "times.txt", files.left.size());
    if (!stamps) return tl::unexpected(stamps.error());
    files.stamp_ns = std::move(*stamps);
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
  } else if (head[0] != 'P' || head[1] < '2' || head[1] > '6') {
    return tl::unexpected(std::string("is no PNG, JPEG, PGM or PPM image"));
  }
  return {};
}

}  // namespace takt::replay
