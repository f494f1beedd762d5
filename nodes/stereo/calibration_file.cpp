// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/calibration_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "nodes/stereo/opencv_calibration.hpp"
#include "rt/file/input_file.hpp"
#include "rt/file/output_file.hpp"

namespace takt::stereo {
namespace {

namespace fs = std::filesystem;
using Matrix3 = cv::Matx33d;
using Vector3 = cv::Vec3d;

constexpr uint64_t kLargestFile = 1 << 20;

constexpr std::string_view kPrefix = "stereo calibration: ";  // as rectify.cpp begins

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument(std::string(kPrefix) + what); }

/// A file as a tree, whose errors name file and line.
class File {
 public:
  explicit File(fs::path path) : path_(std::move(path)) {
    std::error_code failed;
    if (!fs::exists(path_, failed)) refuse(path_.string() + ": no such file; check parameter `calibration`");
    if (!fs::is_regular_file(path_, failed)) refuse(path_.string() + ": is no file; check parameter `calibration`");
    if (fs::file_size(path_, failed) > kLargestFile)
      refuse(path_.string() + ": is larger than 1 MB, so it is no calibration");
    std::ifstream in(path_, std::ios::binary);
    std::string text(std::istreambuf_iterator<char>(in), {});
    if (!in) refuse(path_.string() + ": cannot be read");
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // a byte order mark
    if (text.find_first_not_of(" \t\r\n") != std::string::npos && text[text.find_first_not_of(" \t\r\n")] == '<')
      from_xml();
    else from_yaml(std::move(text));
    if (!root_.IsMap()) refuse(path_.string() + ": holds no keys; " + kForms);
  }

  static constexpr const char* kForms =
      "known are OpenCV's M1, D1, M2, D2, R, T and image_size, ROS camera_info, Kalibr camchains and sensor.yaml of "
      "EuRoC";

  const fs::path& path() const { return path_; }
  bool has(const char* key) const { return root_[key].IsDefined(); }
  YAML::Node at(const char* key) const { return root_[key]; }

  [[noreturn]] void bad(const YAML::Node& node, const std::string& what) const {
    const int line = node.IsDefined() ? node.Mark().line : -1;
    refuse(path_.string() + (line >= 0 ? ":" + std::to_string(line + 1) : "") + ": " + what);
  }

  /// A list of numbers, nested or not, or a matrix with rows, cols and data.
  std::vector<double> numbers(const YAML::Node& node, const std::string& key) const {
    if (!node.IsDefined()) refuse(path_.string() + ": key " + key + " is missing; " + kForms);
    if (node.IsNull()) bad(node, "key " + key + " has no value; was the file cut off?");
    if (node.IsMap()) {
      const YAML::Node data = node["data"];
      if (!data.IsDefined()) bad(node, "key " + key + " has no data; was the file cut off?");
      std::vector<double> found = numbers(data, key);
      const double rows = number(node["rows"], key + ".rows"), columns = number(node["cols"], key + ".cols");
      if (rows * columns != static_cast<double>(found.size()))
        bad(node, "key " + key + " has " + std::to_string(found.size()) + " numbers for " +
                      std::to_string(static_cast<int64_t>(rows)) + " rows of " +
                      std::to_string(static_cast<int64_t>(columns)));
      return found;
    }
    std::vector<double> found;
    if (node.IsScalar()) found.push_back(number(node, key));
    for (const YAML::Node& part : node)
      if (part.IsSequence()) {
        const std::vector<double> row = numbers(part, key);
        found.insert(found.end(), row.begin(), row.end());
      } else {
        found.push_back(number(part, key));
      }
    return found;
  }
  std::vector<double> numbers(const YAML::Node& node, const std::string& key, size_t count) const {
    std::vector<double> found = numbers(node, key);
    if (found.size() != count)
      bad(node, "key " + key + " has " + std::to_string(found.size()) + " numbers, must have " + std::to_string(count));
    return found;
  }
  double number(const YAML::Node& node, const std::string& key) const {
    if (!node.IsDefined() || node.IsNull() || (node.IsScalar() && node.Scalar().empty()))
      bad(node, "key " + key + " has no value; was the file cut off?");
    try {
      return node.as<double>();
    } catch (const YAML::Exception&) {
    }
    bad(node, "`" + (node.IsDefined() && node.IsScalar() ? node.Scalar().substr(0, 40) : std::string("?")) +
                  "` is no number (key " + key + ")");
  }
  int pixels(const YAML::Node& node, const std::string& key) const {
    const double value = number(node, key);
    if (!(value >= 0 && value <= 1e6) || value != std::floor(value))
      bad(node, "key " + key + " is no number of pixels");
    return static_cast<int>(value);
  }

 private:
  void from_yaml(std::string text) {
    // OpenCV's `%YAML:1.0` is no directive of YAML; as a comment it keeps the numbers of the lines.
    if (text.starts_with("%YAML")) text[0] = '#';
    try {
      root_ = YAML::Load(text);
    } catch (const YAML::Exception& problem) {
      std::string hint = "; was the file cut off?";
      if (text.find("\n\t") != std::string::npos)
        hint = "; line " +
               std::to_string(
                   2 + std::count(text.begin(), text.begin() + static_cast<ptrdiff_t>(text.find("\n\t")), '\n')) +
               " begins with a tab, and YAML indents with blanks";
      refuse(path_.string() + ":" + std::to_string(problem.mark.line + 1) + ": " + problem.msg + hint);
    }
  }

  void from_xml() {
    try {
      const cv::FileStorage file(path_.string(), cv::FileStorage::READ);
      for (const char* key : {"M1", "D1", "M2", "D2", "R", "T", "image_size"}) {
        const cv::FileNode node = file[key];
        if (node.empty()) continue;
        cv::Mat values;
        if (node.isMap()) node >> values;
        else {
          std::vector<double> list;
          node >> list;
          values = cv::Mat(list, true);
        }
        values.convertTo(values, CV_64F);
        for (const double value : cv::Mat1d(values)) root_[key].push_back(value);
      }
    } catch (const cv::Exception&) {  // its text names OpenCV's own source
      refuse(path_.string() + ": cannot be read as OpenCV XML; was the file cut off?");
    }
    if (root_.IsNull()) refuse(path_.string() + ": holds none of M1, D1, M2, D2, R, T and image_size");
  }

  fs::path path_;
  YAML::Node root_;
};

/// k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]
void take_distortion(const File& file, const YAML::Node& node, const std::string& key, std::array<double, 5>& first,
                     std::array<double, 9>& more) {
  const std::vector<double> all = file.numbers(node, key);
  if (all.size() != 4 && all.size() != 5 && all.size() != 8 && all.size() != 12 && all.size() != 14)
    file.bad(node, "key " + key + " has " + std::to_string(all.size()) + " numbers, must have 4, 5, 8, 12 or 14");
  const size_t in_first = std::min(all.size(), first.size());
  std::copy_n(all.begin(), in_first, first.begin());
  std::copy(all.begin() + static_cast<ptrdiff_t>(in_first), all.end(), more.begin());
}

template <size_t kCount>
void take(const File& file, const char* key, std::array<double, kCount>& out) {
  const std::vector<double> found = file.numbers(file.at(key), key, kCount);
  std::copy(found.begin(), found.end(), out.begin());
}

void take_cameras(const File& file, StereoCalibration& c) {
  take(file, "M1", c.left_matrix);
  take_distortion(file, file.at("D1"), "D1", c.left_distortion, c.left_more);
  take(file, "M2", c.right_matrix);
  take_distortion(file, file.at("D2"), "D2", c.right_distortion, c.right_more);
}

StereoCalibration from_opencv(const File& file) {
  StereoCalibration c;
  take_cameras(file, c);
  take(file, "R", c.rotation);
  take(file, "T", c.translation_m);
  const YAML::Node size = file.at("image_size");
  if (!size.IsDefined() || !size.IsSequence() || size.size() != 2)
    file.bad(size, "key image_size must be [width, height]");
  c.width = file.pixels(size[0], "image_size");
  c.height = file.pixels(size[1], "image_size");
  return c;
}

void set_pose(StereoCalibration& c, const Matrix3& rotation, const Vector3& translation) {
  std::copy_n(rotation.val, 9, c.rotation.begin());
  std::copy_n(translation.val, 3, c.translation_m.begin());
}

/// One camera of Kalibr or EuRoC, whose keys differ in two words.
void take_pinhole(const File& file, const YAML::Node& node, const std::string& name, const char* coefficients,
                  std::array<double, 9>& matrix, std::array<double, 5>& first, std::array<double, 9>& more) {
  if (!node.IsMap()) file.bad(node, name + " is missing or holds no keys");
  const auto word = [&](const char* key, const char* otherwise) {
    return node[key].IsDefined() && node[key].IsScalar() ? node[key].Scalar() : std::string(otherwise);
  };
  if (const std::string model = word("camera_model", "pinhole"); model != "pinhole")
    file.bad(node["camera_model"], name + " has camera_model " + model + ", must be pinhole");
  const std::string model = word("distortion_model", "radtan");
  if (model != "radtan" && model != "radial-tangential" && model != "none")
    file.bad(node["distortion_model"], name + " has distortion_model " + model +
                                           ", must be radtan, radial-tangential or none; calibrate with that");
  const std::vector<double> k = file.numbers(node["intrinsics"], name + ".intrinsics", 4);
  matrix = {k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1};
  if (model != "none") take_distortion(file, node[coefficients], name + "." + coefficients, first, more);
}

void take_resolution(const File& file, const YAML::Node& node, const std::string& name, StereoCalibration& c) {
  const std::vector<double> size = file.numbers(node["resolution"], name + ".resolution", 2);
  const int width = file.pixels(node["resolution"][0], name), height = file.pixels(node["resolution"][1], name);
  if (c.width != 0 && (c.width != width || c.height != height))
    file.bad(node["resolution"], "the cameras differ in resolution: " + std::to_string(c.width) + " x " +
                                     std::to_string(c.height) + " and " + std::to_string(width) + " x " +
                                     std::to_string(height));
  c.width = width;
  c.height = height;
}

cv::Matx44d transform(const File& file, const YAML::Node& node, const std::string& key) {
  return cv::Matx44d(file.numbers(node, key, 16).data());
}

Matrix3 turn_of(const cv::Matx44d& t) { return t.get_minor<3, 3>(0, 0); }
Vector3 shift_of(const cv::Matx44d& t) { return {t(0, 3), t(1, 3), t(2, 3)}; }

StereoCalibration from_kalibr(const File& file) {
  StereoCalibration c;
  const YAML::Node left = file.at("cam0"), right = file.at("cam1");
  if (!right.IsDefined()) file.bad(left, "this Kalibr camchain has no cam1; a pair is needed");
  take_pinhole(file, left, "cam0", "distortion_coeffs", c.left_matrix, c.left_distortion, c.left_more);
  take_pinhole(file, right, "cam1", "distortion_coeffs", c.right_matrix, c.right_distortion, c.right_more);
  take_resolution(file, left, "cam0", c);
  take_resolution(file, right, "cam1", c);
  const cv::Matx44d pose = transform(file, right["T_cn_cnm1"], "cam1.T_cn_cnm1");
  set_pose(c, turn_of(pose), shift_of(pose));
  return c;
}

/// The file of the other camera: in the name or its folder, the last `from` becomes `to`.
fs::path partner(const File& file, std::initializer_list<std::pair<const char*, const char*>> words) {
  const fs::path folder = file.path().parent_path();
  for (const bool in_name : {true, false}) {
    const std::string name = (in_name ? file.path() : folder).filename().string();
    for (const auto& [from, to] : words) {
      const size_t at = name.rfind(from);
      if (at == std::string::npos) continue;
      std::string other = name;
      other.replace(at, std::strlen(from), to);
      const fs::path path = in_name ? folder / other : folder.parent_path() / other / file.path().filename();
      std::error_code failed;
      if (fs::is_regular_file(path, failed)) return path;
    }
  }
  refuse(file.path().string() +
         ": describes one camera; name the file of the left one, so that the right one is found "
         "(left.yaml and right.yaml, cam0/sensor.yaml and cam1/sensor.yaml)");
}

StereoCalibration from_euroc(const File& left) {
  StereoCalibration c;
  const File right(partner(left, {{"cam0", "cam1"}, {"left", "right"}, {"0", "1"}}));
  const auto body = [](const File& file) { return transform(file, file.at("T_BS"), "T_BS"); };
  const auto root = [](const File& file) {
    YAML::Node all;
    for (const char* key : {"camera_model", "distortion_model", "intrinsics", "distortion_coefficients", "resolution"})
      if (file.has(key)) all[key] = file.at(key);
    return all;
  };
  take_pinhole(left, root(left), "the left camera", "distortion_coefficients", c.left_matrix, c.left_distortion,
               c.left_more);
  take_pinhole(right, root(right), "the right camera", "distortion_coefficients", c.right_matrix, c.right_distortion,
               c.right_more);
  take_resolution(left, root(left), "the left camera", c);
  take_resolution(right, root(right), "the right camera", c);
  const cv::Matx44d a = body(left), b = body(right);  // camera in body
  const Matrix3 turn = turn_of(b).t();
  set_pose(c, turn * turn_of(a), turn * (shift_of(a) - shift_of(b)));
  return c;
}

/// One camera_info: matrix, distortion, the turn to the rectified camera, and its projection.
struct CameraInfo {
  std::array<double, 9> matrix{};
  std::array<double, 5> first{};
  std::array<double, 9> more{};
  Matrix3 rectified;
  std::vector<double> projection;
  int width = 0, height = 0;

  explicit CameraInfo(const File& file) {
    const YAML::Node model = file.at("distortion_model");
    if (model.IsDefined() && model.IsScalar() && model.Scalar() != "plumb_bob" &&
        model.Scalar() != "rational_polynomial")
      file.bad(model, "distortion_model " + model.Scalar() +
                          ", must be plumb_bob or rational_polynomial; calibrate with that");
    take(file, "camera_matrix", matrix);
    take_distortion(file, file.at("distortion_coefficients"), "distortion_coefficients", first, more);
    rectified = Matrix3(file.numbers(file.at("rectification_matrix"), "rectification_matrix", 9).data());
    projection = file.numbers(file.at("projection_matrix"), "projection_matrix", 12);
    width = file.pixels(file.at("image_width"), "image_width");
    height = file.pixels(file.at("image_height"), "image_height");
  }
};

StereoCalibration from_ros(const File& file) {
  const File other(partner(file, {{"left", "right"}, {"0", "1"}}));
  const CameraInfo left(file), right(other);
  if (left.width != right.width || left.height != right.height)
    refuse(other.path().string() + ": differs in size from " + file.path().string());
  if (!(right.projection[0] > 0))
    other.bad(other.at("projection_matrix"), "the focal length of projection_matrix is not positive");
  StereoCalibration c;
  c.width = left.width, c.height = left.height;
  c.left_matrix = left.matrix, c.left_distortion = left.first, c.left_more = left.more;
  c.right_matrix = right.matrix, c.right_distortion = right.first, c.right_more = right.more;
  // The rectified cameras differ by a shift along x alone, -f B in the projection of the right one.
  const Matrix3 back = right.rectified.t();
  set_pose(c, back * left.rectified, back * Vector3(right.projection[3] / right.projection[0], 0, 0));
  return c;
}

StereoCalibration from_file(const File& file) {
  if (file.has("cam0")) return from_kalibr(file);
  if (file.has("T_BS")) return from_euroc(file);
  if (file.has("camera_matrix") && file.has("projection_matrix")) return from_ros(file);
  if (file.has("camera_matrix"))
    refuse(file.path().string() +
           ": describes one camera; a pair with rectification_matrix and projection_matrix is needed: "
           "calibrate both cameras together (ROS camera_calibration, or `takt calibrate`)");
  return from_opencv(file);
}

/// What yaml-cpp refuses, a key in place of a list say, with the file's name.
template <class Read>
StereoCalibration guarded(const fs::path& path, const Read& read) {
  try {
    return read();
  } catch (const YAML::Exception& problem) {
    refuse(path.string() + ":" + std::to_string(problem.mark.line + 1) + ": " + problem.msg);
  }
}

}  // namespace

StereoCalibration read_calibration(const fs::path& path) {
  const StereoCalibration calibration = guarded(path, [&] { return from_file(File(path)); });
  try {
    check_calibration(calibration);
  } catch (const std::invalid_argument& problem) {
    refuse(path.string() + ": " + std::string(problem.what()).substr(kPrefix.size()));
  }
  return calibration;
}

StereoCalibration read_intrinsics(const fs::path& path) {
  return guarded(path, [&] {
    StereoCalibration c;
    take_cameras(File(path), c);
    return c;
  });
}

void write_calibration(const fs::path& path, const StereoCalibration& c, const std::string& comment) {
  const std::string extension = path.extension().string();
  if (extension != ".yaml" && extension != ".yml" && extension != ".xml")
    refuse(path.string() + ": must end in .yaml, .yml or .xml");
  try {
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE | cv::FileStorage::MEMORY);  // its format by the name
    file.writeComment(comment);
    file << "image_size" << std::vector<int>{c.width, c.height};
    file << "M1" << opencv_matrix(c.left_matrix, 3) << "D1" << opencv_distortion(c.left_distortion, c.left_more);
    file << "M2" << opencv_matrix(c.right_matrix, 3) << "D2" << opencv_distortion(c.right_distortion, c.right_more);
    file << "R" << opencv_matrix(c.rotation, 3) << "T" << opencv_matrix(c.translation_m, 3);
    require_written(write_file(path, file.releaseAndGetString()));
  } catch (const cv::Exception& e) {
    refuse(path.string() + ": " + e.err);
  }
}

}  // namespace takt::stereo
