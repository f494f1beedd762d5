// SPDX-License-Identifier: Apache-2.0
// `takt calibrate` from recordings to the files it writes.
#include <doctest/doctest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "graph/run/run.hpp"
#include "graph/tools/calibrate_command.hpp"
#include "nodes/calibration/generated_sweeps.hpp"
#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/rectify.hpp"
#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/calibration/chessboard_views.hpp"

using namespace takt;
using namespace takt::command;

namespace {

int run(const std::string& arguments) {
  CLI::App app;
  CalibrateOptions options;
  int exit_code = -1;
  add_calibrate(app, options, exit_code);
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError&) {  // a file that is not there; as main() answers it
    return kBadInput;
  }
  return exit_code;
}

}  // namespace

TEST_CASE("pictures of a board become a file that the stereo node reads, and a picture") {
  const takt::test::TemporaryFolder folder;
  const takt::test::ChessboardScene scene;
  const auto pairs = scene.render(8);
  for (size_t i = 0; i < pairs.size(); ++i) {
    REQUIRE(cv::imwrite(folder.path / ("l" + std::to_string(i) + ".png"), pairs[i].left));
    REQUIRE(cv::imwrite(folder.path / ("r" + std::to_string(i) + ".png"), pairs[i].right));
  }
  const std::string rig = folder.path / "rig.yaml", picture = folder.path / "picture.png",
                    common = "calibrate stereo " + folder.path.string() + " --left l*.png --right r*.png ";
  CHECK(run(common + "--square 0.022 --out " + rig + " --picture " + picture) == kOk);
  const stereo::StereoCalibration found = stereo::read_calibration(rig);
  CHECK(found.translation_m[0] == doctest::Approx(scene.truth.translation_m[0]).epsilon(0.02));
  CHECK(stereo::Rectifier(found).camera().focal_px > 300);
  CHECK_FALSE(cv::imread(picture).empty());

  CHECK(run(common + "--board 6x6") == kBadInput);
  CHECK(run(common + "--board nine") == kBadInput);
  CHECK(run(common + "--out " + (folder.path / "none" / "rig.yaml").string()) == kBadInput);
  CHECK(run(common + "--picture " + (folder.path / "picture.nothing").string()) == kBadInput);
  // A picture that was cut off, and one that is missing.
  std::filesystem::resize_file(folder.path / "r3.png", 2000);
  CHECK(run(common) == kBadInput);
  std::filesystem::remove(folder.path / "r3.png");
  CHECK(run(common) == kBadInput);
}

TEST_CASE("the calibration shipped beside a rig of raw pairs is the one its rig file gives") {
  const takt::test::TemporaryFolder folder;
  const std::filesystem::path rigs = takt::test::graph_folder() / "rigs";
  const std::string out = folder.path / "made.yaml";
  CHECK(run("calibrate rig " + (rigs / "xb3_raw.yaml").string() + " --out " + out) == kOk);
  const auto made = stereo::read_calibration(out),
             shipped = stereo::read_calibration(rigs / "xb3_raw_calibration.yaml");
  CHECK(made.width == shipped.width);
  CHECK(made.height == shipped.height);
  const auto same = [](const auto& a, const auto& b) {
    for (size_t i = 0; i < a.size(); ++i) CHECK(a[i] == doctest::Approx(b[i]).epsilon(1e-12));
  };
  same(made.left_matrix, shipped.left_matrix);
  same(made.right_matrix, shipped.right_matrix);
  same(made.left_distortion, shipped.left_distortion);
  same(made.right_distortion, shipped.right_distortion);
  same(made.rotation, shipped.rotation);
  same(made.translation_m, shipped.translation_m);
  CHECK(made.rotation[0] < 1 - 1e-6);  // not parallel

  CHECK(run("calibrate rig " + (rigs / "xb3.yaml").string() + " --out " + out) == kBadInput);
  CHECK(run("calibrate rig " + (rigs / "none.yaml").string() + " --out " + out) == kBadInput);
  CHECK(run("calibrate rig " + (rigs / "xb3_raw.yaml").string() + " --out " + (folder.path / "made").string()) ==
        kBadInput);
}

TEST_CASE("pictures without a board are refused") {
  const takt::test::TemporaryFolder folder;
  for (const char* name : {"left1.png", "right1.png", "left2.png", "right2.png"})
    REQUIRE(cv::imwrite(folder.path / name, cv::Mat(48, 64, CV_8U, cv::Scalar(90))));
  CHECK(run("calibrate stereo " + folder.path.string() + " --left left*.png --right right*.png") == kBadInput);
}

TEST_CASE("sweeps of lasers become mounts for a graph, and a picture") {
  const takt::test::TemporaryFolder folder;
  const std::string sweeps = folder.path / "sweeps.txt", mounts = folder.path / "mounts.yaml",
                    picture = folder.path / "picture.png";
  const auto generated = calibration::generate_sweeps({.headings = 180, .beams = 181}, 1);
  calibration::write_laser_recording(sweeps, generated.recording, generated.beams);
  CHECK(run("calibrate lasers " + sweeps + " --out " + mounts + " --picture " + picture) == kOk);
  CHECK_FALSE(cv::imread(picture).empty());
  std::ifstream in(mounts);
  std::string line;
  int scanners = 0;
  while (std::getline(in, line)) scanners += line.find(": {x: ") != std::string::npos;
  CHECK(scanners == 2);

  CHECK(run("calibrate lasers") == kBadInput);
  CHECK(run("calibrate lasers " + mounts) == kBadInput);
  CHECK(run("calibrate lasers " + sweeps + " --picture " + (folder.path / "picture.nothing").string()) == kBadInput);
  CHECK(run("calibrate lasers " + sweeps + " --out " + (folder.path / "none" / "mounts.yaml").string()) == kBadInput);
}
