// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/image_pairs.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "tests/temporary_folder.hpp"

using namespace takt::calibration;
using takt::test::TemporaryFolder;

namespace {

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

void write_image(const std::filesystem::path& file, int width, int height) {
  REQUIRE(cv::imwrite(file.string(), cv::Mat(height, width, CV_8U, cv::Scalar(7))));
}

}  // namespace

TEST_CASE("pairs belong together by what stands for the star, in its order") {
  const TemporaryFolder folder;
  for (const char* name : {"left2.png", "left10.png", "right10.png", "right2.png", "left_note.txt", "other.png"})
    folder.write(name, "");
  const auto pairs = find_pairs(folder.path, "left*.png", "right*.png");
  REQUIRE(pairs.size() == 2);
  CHECK(pairs[0].name == "10");
  CHECK(pairs[1].left.filename() == "left2.png");
  CHECK(pairs[1].right.filename() == "right2.png");
}

TEST_CASE("what cannot be paired is refused with its name") {
  const TemporaryFolder folder;
  const auto find = [&](const char* left, const char* right) {
    return refusal([&] { find_pairs(folder.path, left, right); });
  };
  CHECK(says(find("left*.png", "right*.png"), "left*.png"));
  folder.write("left1.png", "");
  CHECK(says(find("left*.png", "right*.png"), "right*.png"));
  folder.write("right1.png", "");
  CHECK(find("left*.png", "right*.png") == "accepted");
  folder.write("right2.png", "");
  CHECK(says(find("left*.png", "right*.png"), "right2.png"));
  CHECK(says(find("left*.png", "right*.png"), "left2.png"));
  CHECK(says(find("left.png", "right*.png"), "left.png"));
  CHECK(says(find("left*.png", "*right*.png"), "*right*.png"));
  CHECK(says(refusal([&] { find_pairs(folder.path / "none", "left*.png", "right*.png"); }), "none"));
}

TEST_CASE("images that cannot be decoded, or of another size, are refused with their names") {
  const TemporaryFolder folder;
  for (const char* name : {"left1.png", "right1.png", "left2.png"}) write_image(folder.path / name, 8, 6);
  write_image(folder.path / "right2.png", 8, 7);
  const auto read = [&] { return refusal([&] { read_pairs(find_pairs(folder.path, "left*.png", "right*.png")); }); };
  CHECK(says(read(), "right2.png"));
  CHECK(says(read(), "8 x 7"));
  folder.write("right2.png", "no image");
  CHECK(says(read(), "right2.png"));
  write_image(folder.path / "right2.png", 8, 6);
  CHECK(read() == "accepted");
}
