// SPDX-License-Identifier: Apache-2.0
// Calibrations of OpenCV, ROS, Kalibr and EuRoC; what is wrong with them is said with file and line.
#include "nodes/stereo/calibration_file.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt::stereo;
using takt::test::has;

namespace {

std::string opencv(const std::string& d1, int count, const std::string& rows = "3",
                   const std::string& shift = "-0.2, 0., 0.") {
  const auto matrix = [](const std::string& key, const std::string& r, int c, const std::string& data) {
    return key + ": !!opencv-matrix\n   rows: " + r + "\n   cols: " + std::to_string(c) + "\n   dt: d\n   data: [ " +
           data + " ]\n";
  };
  const std::string k = "410., 0., 322., 0., 411., 241., 0., 0., 1.";
  return "%YAML:1.0\n---\nimage_size: [ 640, 480 ]\n" + matrix("M1", rows, 3, k) + matrix("D1", "1", count, d1) +
         matrix("M2", rows, 3, k) + matrix("D2", "1", count, d1) +
         matrix("R", rows, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") + matrix("T", rows, 1, shift);
}

std::string coefficients(int count) {
  std::string text = "0.1";
  for (int i = 2; i <= count; ++i) text += ", 0." + std::to_string(i < 10 ? i : i * 10);
  return text;
}

std::string error_of(const std::filesystem::path& file) {
  try {
    static_cast<void>(rectification_tables(read_calibration(file)));
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "";
}

struct FileBench {
  takt::test::TemporaryFolder folder;
  std::string error(const std::string& text) const {
    const auto file = folder.write("rig.yaml", text);
    const std::string what = error_of(file);
    CHECK((what.empty() || has(what, "calibration: ")));
    return what;
  }
};

}  // namespace

TEST_CASE("OpenCV's files with 4, 5, 8, 12 and 14 coefficients, and back") {
  const FileBench bench;
  for (const int count : {4, 5, 8, 12, 14}) {
    CAPTURE(count);
    const StereoCalibration c = read_calibration(bench.folder.write("rig.yaml", opencv(coefficients(count), count)));
    CHECK(c.width == 640);
    CHECK(c.left_matrix[4] == 411);
    CHECK(c.left_distortion[3] == 0.4);
    CHECK(c.left_distortion[4] == (count >= 5 ? 0.5 : 0));
    CHECK(c.right_more[2] == (count >= 8 ? 0.8 : 0));
    CHECK(c.right_more[8] == (count == 14 ? 0.140 : 0));
    CHECK(c.translation_m[0] == -0.2);
    for (const char* name : {"again.yaml", "again.xml"}) {
      write_calibration(bench.folder.path / name, c, "again");
      const StereoCalibration again = read_calibration(bench.folder.path / name);
      CHECK(again.left_distortion == c.left_distortion);
      CHECK(again.left_more == c.left_more);
      CHECK(again.rotation == c.rotation);
      CHECK(again.height == c.height);
    }
  }
  CHECK(has(bench.error(opencv(coefficients(6), 6)), ": key D1 has 6 numbers, must have 4, 5, 8, 12 or 14"));
  CHECK(bench.error(opencv("0., 0., 0., 0., 0.", 5)).empty());
}

TEST_CASE("the coefficients beyond the fifth count: a rational model is undistorted as OpenCV does") {
  const FileBench bench;
  StereoCalibration c = read_calibration(bench.folder.write("rig.yaml", opencv("0., 0., 0., 0., 0.", 5)));
  const auto plain = undistortion_table(c).left;
  c.left_more[0] = 0.2;  // k4: towards the centre
  const auto more = undistortion_table(c).left;
  const size_t corner = 20 * 640 + 20;
  CHECK(more[corner].x > plain[corner].x);
  CHECK(more[240 * 640 + 322].x == plain[240 * 640 + 322].x);
}

TEST_CASE("a Kalibr camchain, camera_info pairs of ROS and EuRoC's sensor files say the same as OpenCV's form") {
  const FileBench bench;
  const StereoCalibration expected = read_calibration(bench.folder.write("rig.yaml", opencv("0.1, 0.2, 0.3, 0.4", 4)));
  const auto check = [&](const StereoCalibration& c) {
    CHECK(c.width == expected.width);
    CHECK(c.height == expected.height);
    CHECK(c.left_matrix == expected.left_matrix);
    CHECK(c.right_matrix == expected.right_matrix);
    CHECK(c.left_distortion == expected.left_distortion);
    CHECK(c.right_distortion == expected.right_distortion);
    for (size_t i = 0; i < 9; ++i) CHECK(std::abs(c.rotation[i] - expected.rotation[i]) < 1e-9);
    for (size_t i = 0; i < 3; ++i) CHECK(std::abs(c.translation_m[i] - expected.translation_m[i]) < 1e-9);
  };
  const std::string pinhole =
      "  camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\n"
      "  intrinsics: [410, 411, 322, 241]\n  resolution: [640, 480]\n";
  const std::string pose = "  T_cn_cnm1:\n  - [1, 0, 0, -0.2]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n";
  check(read_calibration(bench.folder.write("camchain.yaml", "cam0:\n" + pinhole + "cam1:\n" + pose + pinhole)));
  CHECK(has(error_of(bench.folder.write("one.yaml", "cam0:\n" + pinhole)),
            "one.yaml:2: this Kalibr camchain has no cam1"));
  std::string fisheye = "cam0:\n" + pinhole + "cam1:\n" + pose + pinhole;
  fisheye.replace(fisheye.find("radtan"), 6, "equidistant");
  CHECK(has(error_of(bench.folder.write("fish.yaml", fisheye)), "fish.yaml:3: cam0 has distortion_model equidistant"));

  const auto info = [](const std::string& shift) {
    const auto matrix = [](const std::string& key, int rows, int columns, const std::string& data) {
      return key + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(columns) + "\n  data: [" +
             data + "]\n";
    };
    return "image_width: 640\nimage_height: 480\ncamera_name: a\n" +
           matrix("camera_matrix", 3, 3, "410, 0, 322, 0, 411, 241, 0, 0, 1") + "distortion_model: plumb_bob\n" +
           matrix("distortion_coefficients", 1, 5, "0.1, 0.2, 0.3, 0.4, 0") +
           matrix("rectification_matrix", 3, 3, "0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8") +
           matrix("projection_matrix", 3, 4, "400, 0, 320, " + shift + ", 0, 400, 240, 0, 0, 0, 1, 0");
  };
  // Both cameras turned alike: the baseline of the raw cameras is turned back.
  bench.folder.write("right.yaml", info("-80"));
  const StereoCalibration ros = read_calibration(bench.folder.write("left.yaml", info("0")));
  CHECK(ros.left_matrix == expected.left_matrix);
  CHECK(ros.rotation[0] == doctest::Approx(1));
  CHECK(ros.translation_m[0] == doctest::Approx(-0.2 * 0.8));
  CHECK(ros.translation_m[2] == doctest::Approx(-0.2 * 0.6));
  const std::string alone = info("0");
  CHECK(has(error_of(bench.folder.write("camera.yaml", alone)), "camera.yaml: describes one camera"));
  CHECK(has(error_of(bench.folder.write("mono.yaml", alone.substr(0, alone.find("rectification")))), "a pair with"));

  const auto sensor = [&](const std::string& x) {
    return "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, 0.5, 1, 0, 0, " + x +
           ", 0, 0, 1, 0.25, 0, 0, 0, 1]\nresolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [410, 411, 322, "
           "241]\n"
           "distortion_model: radial-tangential\ndistortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n";
  };
  for (const char* camera : {"cam0", "cam1"}) {
    std::filesystem::create_directories(bench.folder.path / "mav0" / camera);
    bench.folder.write(std::string("mav0/") + camera + "/sensor.yaml", sensor(camera[3] == '0' ? "0.1" : "0.3"));
  }
  check(read_calibration(bench.folder.path / "mav0/cam0/sensor.yaml"));
}

TEST_CASE("files that are none, cut off, or say what cannot be meant are refused with file, line and advice") {
  const FileBench bench;
  const std::string good = opencv("0., 0., 0., 0., 0.", 5);
  CHECK(bench.error("\xEF\xBB\xBF" + good).empty());
  std::string tabs = good;
  tabs.replace(tabs.find("   data"), 3, "\t");
  CHECK(has(bench.error(tabs), "line 8 begins with a tab"));
  CHECK(has(bench.error(good.substr(0, good.find("   data"))), "key M1 has no data; was the file cut off?"));
  CHECK(has(bench.error(good.substr(0, good.find("D1: !!opencv-matrix") + 19)),
            "key D1 has no value; was the file cut off?"));
  CHECK(has(bench.error(opencv("0., 0., 0., 0., 0.", 5, "300000000")), "9 numbers for 300000000 rows of 3"));
  CHECK(has(bench.error(opencv("0., 0., x, 0., 0.", 5)), "`x` is no number (key D1)"));
  CHECK(has(bench.error(opencv("0., 0., 0., 0., 0.", 5, "3", "-120., 0., 0.")),
            "rig.yaml: translation_m is a baseline of 120.000000 m"));
  std::string centre = good;
  centre.replace(centre.find("322."), 4, "922.");
  CHECK(has(bench.error(centre), "another resolution"));
  CHECK(has(bench.error("image_size: [640, 480]\n"), "key M1 is missing; known are"));
  CHECK(has(bench.error("a list\n"), "holds no keys"));
  CHECK(has(bench.error(""), "holds no keys"));
  CHECK(has(bench.error("<?xml version=\"1.0\"?>\n<opencv_storage>\n<M1"), "cannot be read as OpenCV XML"));
  CHECK(has(bench.error("[1, 2"), "rig.yaml:1: "));
  CHECK(has(error_of(bench.folder.path), "is no file"));
  CHECK(has(error_of(bench.folder.path / "none"), "no such file"));
  for (size_t at = 0; at < good.size(); at += 7) static_cast<void>(bench.error(good.substr(0, at)));
}
