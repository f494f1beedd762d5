// SPDX-License-Identifier: Apache-2.0
// Pictures of 8 to 16 bits become 8 bits by what their file says of the largest value; never are bits cut off.
#include "rt/image_file/image_file.hpp"

#include <doctest/doctest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "rt/image_file/image_list.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using test::has;

namespace {

/// Values 0, top / 3, 2 top / 3, top.
cv::Mat1w ramp(unsigned top) {
  cv::Mat1w image(1, 4);
  for (int x = 0; x < 4; ++x) image(0, x) = static_cast<uint16_t>(top * static_cast<unsigned>(x) / 3);
  return image;
}

std::string pgm(const cv::Mat1w& image, unsigned maxval) {
  std::string text = "P5\n# a camera's\n" + std::to_string(image.cols) + " " + std::to_string(image.rows) + "\n" +
                     std::to_string(maxval) + "\n";
  for (const uint16_t value : image) {
    if (maxval > 255) text += static_cast<char>(value >> 8U);
    text += static_cast<char>(value & 255U);
  }
  return text;
}

std::string big_endian(size_t value) {
  std::string bytes;
  for (unsigned shift = 32; shift > 0;) bytes += static_cast<char>(value >> (shift -= 8) & 255U);
  return bytes;
}

/// OpenCV's PNG with a chunk sBIT behind its head.
std::string png(const test::TemporaryFolder& folder, const cv::Mat1w& image, int significant) {
  const auto file = folder.path / "plain.png";
  cv::imwrite(file.string(), image);
  std::ifstream in(file, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(in), {});
  const std::string chunk = std::string("sBIT") + static_cast<char>(significant);
  const auto crc = crc32(0, reinterpret_cast<const unsigned char*>(chunk.data()), 5);
  text.insert(8 + 25, big_endian(1) + chunk + big_endian(crc));
  return text;
}

std::vector<int> values(const cv::Mat& image) { return {image.begin<uint8_t>(), image.end<uint8_t>()}; }

std::string error_of(const std::filesystem::path& file, int bits = 0) {
  try {
    read_image(file, Channels::grey, bits);
  } catch (const ImageError& problem) {
    CHECK(std::string(problem.what()).starts_with(file.string() + ": "));
    return problem.what();
  }
  return "";
}

const std::vector<int> kWhole{0, 85, 170, 255};

}  // namespace

TEST_CASE("a picture of any depth uses the whole range of 8 bits") {
  const test::TemporaryFolder folder;
  for (const int bits : {8, 10, 12, 14, 16}) {
    CAPTURE(bits);
    const unsigned top = (1U << static_cast<unsigned>(bits)) - 1;
    CHECK(values(read_image(folder.write("a.pgm", pgm(ramp(top), top)), Channels::grey)) == kWhole);
    if (bits == 8) continue;
    // sBIT, the values at the bottom as cameras write them, or on top as the format wants them
    CHECK(values(read_image(folder.write("a.png", png(folder, ramp(top), bits)), Channels::grey)) == kWhole);
    const int shift = 16 - bits;
    cv::Mat1w on_top = ramp(top);
    for (uint16_t& value : on_top) value = static_cast<uint16_t>(value << shift);
    const auto read = values(read_image(folder.write("b.png", png(folder, on_top, bits)), Channels::grey));
    for (size_t i = 0; i < 4; ++i) CHECK(std::abs(read[i] - kWhole[i]) <= 1);
    // nothing in the file says so
    cv::imwrite((folder.path / "c.png").string(), ramp(top));
    CHECK(values(read_image(folder.path / "c.png", Channels::grey, bits)) == kWhole);
    if (bits == 16) CHECK(values(read_image(folder.path / "c.png", Channels::grey)) == kWhole);
    else CHECK(has(error_of(folder.path / "c.png"), "say `bits: " + std::to_string(bits) + "`"));
  }
  // PGM of fewer than 8 bits
  CHECK(values(read_image(folder.write("d.pgm", pgm(ramp(15), 15)), Channels::grey)) == kWhole);
  CHECK(values(read_image(folder.write("e.pgm", "P2\n4 1\n15\n0 5 10 15\n"), Channels::grey)) == kWhole);
  CHECK(values(read_image(folder.write("f.pgm", "P2\n4 1\n1023\n0 341 682 1023\n"), Channels::grey)) == kWhole);
}

TEST_CASE("colour keeps its channels") {
  const test::TemporaryFolder folder;
  cv::imwrite((folder.path / "c.png").string(), cv::Mat(1, 1, CV_16UC3, cv::Scalar(0, 1023 * 16, 65535)));
  const cv::Mat image = read_image(folder.path / "c.png", Channels::as_file);
  REQUIRE(image.type() == CV_8UC3);
  CHECK(image.at<cv::Vec3b>(0, 0) == cv::Vec3b(0, 64, 255));
  CHECK(read_image(folder.path / "c.png", Channels::grey).type() == CV_8UC1);
  CHECK(read_values(folder.path / "c.png").type() == CV_16UC3);
}

TEST_CASE("a PFM keeps its floats, its first row on top, infinity where nothing is known") {
  const test::TemporaryFolder folder;
  const float rows[]{3, 4, 1, std::numeric_limits<float>::infinity()};  // from the bottom
  const auto file =
      folder.write("d.pfm", "Pf\n2 2\n-1\n" + std::string(reinterpret_cast<const char*>(rows), sizeof rows));
  const cv::Mat1f read = read_floats(file);
  CHECK(read(0, 0) == 1);
  CHECK(std::isinf(read(0, 1)));
  CHECK(read(1, 1) == 4);
  CHECK(has(error_of(file), "no whole numbers"));
  cv::imwrite((folder.path / "c.png").string(), ramp(1023));
  CHECK_THROWS_AS(read_floats(folder.path / "c.png"), ImageError);
}

TEST_CASE("what is not read is refused with the file's name") {
  const test::TemporaryFolder folder;
  cv::imwrite((folder.path / "c.png").string(), ramp(1023));
  CHECK(has(error_of(folder.path / "c.png", 8), "1023, which has more than 8 bits"));
  CHECK(has(error_of(folder.path / "none.png"), "No such file"));
  CHECK(has(error_of(folder.path), "is a folder"));
  CHECK(has(error_of(folder.write("text.png", "no image")), "is no image"));
  // A decoder of OpenCV ends the process over it.
  CHECK(has(error_of(folder.write("dicom.png", std::string(128, ' ') + "DICM")), "is no image of a known kind"));
  for (const char* head : {"P5\n60000 60000\n255\n", "P6\n60000 60000\n65535\n", "P5\n30000 30000\n255\n"})
    CHECK(has(error_of(folder.write("huge.pgm", head)), "000 px"));
  std::string claims = png(folder, ramp(1023), 10);
  claims.replace(16, 8, big_endian(60000) + big_endian(60000));
  const auto crc = crc32(0, reinterpret_cast<const unsigned char*>(claims.data()) + 12, 17);
  claims.replace(29, 4, big_endian(crc));
  CHECK(has(error_of(folder.write("huge.png", claims)), "60000 x 60000 px"));
}

TEST_CASE("frames come in the order of their numbers") {
  const test::TemporaryFolder folder;
  for (const char* name : {"f10.png", "f9.png", "f010.PNG", "f2.pgm", "a.tiff", "notes.txt", "f2b.png"})
    folder.write(name, "");
  std::filesystem::create_directory(folder.path / "old.png");
  const ImageList list = list_images(folder.path);
  std::vector<std::string> names;
  for (const auto& file : list.files) names.push_back(file.filename().string());
  CHECK(names == std::vector<std::string>{"a.tiff", "f2.pgm", "f2b.png", "f9.png", "f010.PNG", "f10.png"});
  CHECK(has(left_out_text(folder.path, list), "1 files that are no images are left out (the first: notes.txt)"));
  CHECK(left_out_text(folder.path, {}).empty());
  CHECK_THROWS_AS(list_images(folder.path / "none"), std::filesystem::filesystem_error);
  // A strict order: digits of any length, zeros before them.
  const std::vector<std::string> sorted{"",  "1",  "2",   "02", "10", "1x", "99999999999999999999999",
                                        "a", "a1", "a1b", "a2", "a10"};
  for (const auto& a : sorted) {
    CHECK_FALSE(in_numeric_order(a, a));
    for (const auto& b : sorted)
      if (a != b) CHECK(in_numeric_order(a, b) != in_numeric_order(b, a));
  }
}
