// SPDX-License-Identifier: Apache-2.0
// `takt calibrate stereo` from a folder of pictures to the files it writes.
#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>

#include "graph/command/calibrate_command.hpp"
#include "graph/command/run_command.hpp"
#include "nodes/stereo/rectify.hpp"
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
  app.parse(arguments);
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

TEST_CASE("pictures without a board are refused") {
  const takt::test::TemporaryFolder folder;
  for (const char* name : {"left1.png", "right1.png", "left2.png", "right2.png"})
    REQUIRE(cv::imwrite(folder.path / name, cv::Mat(48, 64, CV_8U, cv::Scalar(90))));
  CHECK(run("calibrate stereo " + folder.path.string() + " --left left*.png --right right*.png") == kBadInput);
}
