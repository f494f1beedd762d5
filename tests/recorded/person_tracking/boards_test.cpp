// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "nodes/person_tracking/chessboard_finder.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt::person_tracking;
using takt::test::recording;

TEST_CASE("against cv::findChessboardCorners on real boards: its corners are among ours") {
  const auto data = recording("calibration/chessboard_stereo");
  const auto find = [](ChessboardFinder& finder, const cv::Mat& image, int level) {
    return finder.find({image.data, image.cols, image.rows, image.channels()}, {0, 0, 640, 480}, level);
  };
  int theirs = 0, ours = 0, boards = 0, images = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data)) {
    if (entry.path().extension() != ".jpg") continue;
    const cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
    ++images;
    std::vector<cv::Point2f> corners;
    if (!cv::findChessboardCorners(image, {9, 6}, corners)) continue;
    cv::cornerSubPix(image, corners, {5, 5}, {-1, -1}, {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 30, 0.01});
    ChessboardFinder finder(image.cols, image.rows, 1, {});
    int most = 0, level_of_most = 0;
    for (int level = 0; level < ChessboardFinder::kLevels; ++level)
      if (const auto found = find(finder, image, level); !found.empty() && found[0].corners > most)
        most = found[0].corners, level_of_most = level;
    boards += most > 0 ? 1 : 0;
    find(finder, image, level_of_most);
    for (const cv::Point2f& corner : corners) {
      ++theirs;
      for (const Corner& other : finder.corners())
        if (std::hypot(other.x - corner.x, other.y - corner.y) < 1.5 * (1 << level_of_most)) {
          ++ours;
          break;
        }
    }
  }
  MESSAGE("boards in " << boards << " of " << images << " images, " << ours << " of OpenCV's " << theirs << " corners");
  CHECK(boards >= images * 9 / 10);
  CHECK(ours >= theirs * 9 / 10);
}
