// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/frame_codec.hpp"

#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "tests/unit/camera/eyes.hpp"
#include "tests/unit/can/golden_frames.hpp"

using namespace takt;
using namespace takt::v4l2;
using namespace takt::test;

namespace {

void check_planes(const char* frame, FrameFormat format, int left, int right, const char* left_plane) {
  const Eyes eyes = eyes_of(test::bytes_of(frame), layout_of(format, left, right));
  CHECK(eyes.rows == 2);
  CHECK(eyes.left == test::bytes_of(left_plane));
  CHECK(eyes.right == test::bytes_of(kRight));
}

}  // namespace

TEST_CASE("frame codec: the golden frames of Bumblebee2 and XB3, in every order of planes") {
  constexpr const char* kThree = "0AC8640BC9650CCA660DCB6714D26E15D36F16D47017D571";
  check_planes("0A640B650C660D67146E156F16701771", FrameFormat::y16, 1, 0, kLeft);
  check_planes("640A650B660C670D6E146F1570167117", FrameFormat::y8i, 0, 1, kLeft);
  check_planes("0AC80BC90CCA0DCB14D215D316D417D5", FrameFormat::y16, 1, 0, kCentre);
  check_planes(kThree, FrameFormat::rgb3, 2, 0, kLeft);
  check_planes(kThree, FrameFormat::rgb3, 1, 0, kCentre);
}

TEST_CASE("frame codec: rows are stepped by the device's stride, and a short frame gives its whole rows") {
  const auto bytes = test::bytes_of("0A640B650C660D67EEEEEE146E156F16701771");  // 3 bytes of padding, none at the end
  FrameLayout layout = layout_of(FrameFormat::y16, 1, 0);
  layout.bytes_per_line = 11;
  CHECK(eyes_of(bytes, layout).left == test::bytes_of(kLeft));
  for (size_t length = 0; length <= bytes.size(); ++length) {
    const Eyes eyes = eyes_of(std::span(bytes).first(length), layout);
    const int rows = length >= 19 ? 2 : length >= 8 ? 1 : 0;
    CHECK(eyes.rows == rows);
    for (size_t i = static_cast<size_t>(rows) * 4; i < 8; ++i) CHECK(eyes.left[i] == 0xA5);
  }
}

TEST_CASE("frame codec: halves side by side, grey and in colour") {
  const FrameLayout grey = layout_of(FrameFormat::grey, 0, 1);
  CHECK(grey.frame_width() == 8);
  const Eyes eyes = eyes_of(test::bytes_of("646566670A0B0C0D6E6F707114151617"), grey);
  CHECK(eyes.left == test::bytes_of(kLeft));
  CHECK(eyes.right == test::bytes_of(kRight));
  // BT.601: black, white, and the primaries, of which each has an exact level of 8 bits.
  FrameLayout colour = layout_of(FrameFormat::yuyv, 0, 1);
  colour.width = 2;
  colour.height = 1;
  const auto bgr = [&](const char* left) {
    std::vector<uint8_t> frame = test::bytes_of(left);
    for (const uint8_t byte : test::bytes_of("10801080")) frame.push_back(byte);
    const Eyes both = eyes_of(frame, colour);
    CHECK(both.right == std::vector<uint8_t>(6, 0));
    return both.left;
  };
  CHECK(bgr("1080EB80") == std::vector<uint8_t>{0, 0, 0, 255, 255, 255});
  const auto red = bgr("525A52F0");
  CHECK(red[2] >= 254);
  CHECK(std::max(red[0], red[1]) <= 1);
  const auto blue = bgr("29F0296E");
  CHECK(blue[0] >= 254);
  CHECK(std::max(blue[1], blue[2]) <= 1);
}

TEST_CASE("frame codec: each mosaic gives its colours back") {
  constexpr int kSize = 8;
  constexpr uint8_t kBgr[3] = {40, 120, 200};
  for (const auto& [pattern, letters] : std::initializer_list<std::pair<Mosaic, const char*>>{
           {Mosaic::rggb, "RGGB"}, {Mosaic::grbg, "GRBG"}, {Mosaic::gbrg, "GBRG"}, {Mosaic::bggr, "BGGR"}}) {
    std::vector<uint8_t> plane(kSize * kSize), image(plane.size() * 3);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const char letter = letters[y % 2 * 2 + x % 2];
        plane[static_cast<size_t>(y * kSize + x)] = kBgr[letter == 'B' ? 0 : letter == 'G' ? 1 : 2];
      }
    }
    debayer({plane.data(), kSize, kSize}, pattern, {image.data(), kSize, kSize, 3});
    for (size_t i = 0; i < image.size(); ++i) CHECK(image[i] == kBgr[i % 3]);
  }
}

TEST_CASE("frame codec: what is joined is split again, and a mosaic keeps the colours that it sees") {
  std::mt19937 random(5);
  const auto noise = [&](size_t bytes) {
    std::vector<uint8_t> values(bytes);
    for (uint8_t& value : values) value = static_cast<uint8_t>(random());
    return values;
  };
  constexpr int kWidth = 10, kHeight = 6;
  for (const FrameFormat format : {FrameFormat::y16, FrameFormat::y8i, FrameFormat::rgb3, FrameFormat::grey}) {
    for (const Mosaic mosaic : {Mosaic::none, Mosaic::rggb, Mosaic::grbg, Mosaic::gbrg, Mosaic::bggr}) {
      FrameLayout layout;
      layout.format = format;
      layout.width = kWidth;
      layout.height = kHeight;
      layout.left = 0;
      layout.right = 1;
      layout.mosaic = mosaic;
      layout.bytes_per_line = layout.row_bytes() + 4;
      const int channels = mosaic == Mosaic::none ? 1 : 3;
      const auto left = noise(kWidth * kHeight * static_cast<size_t>(channels)), right = noise(left.size());
      const ImageView<const uint8_t> l(left.data(), kWidth, kHeight, channels),
          r(right.data(), kWidth, kHeight, channels);
      std::vector<uint8_t> frame(layout.image_bytes(), 0xEE);
      CHECK_FALSE(join(l, r, layout, std::span(frame).first(frame.size() - 1)));
      REQUIRE(join(l, r, layout, frame));
      std::vector<uint8_t> again_left(kWidth * kHeight), again_right(again_left);
      REQUIRE(split(frame, layout, {again_left.data(), kWidth, kHeight}, {again_right.data(), kWidth, kHeight}) ==
              kHeight);
      const char* letters = mosaic == Mosaic::none ? "" : kMosaicNames[static_cast<size_t>(mosaic)].data();
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const auto i = static_cast<size_t>(y * kWidth + x);
          const size_t colour = channels == 1 ? 0 : std::string_view("bgr").find(letters[y % 2 * 2 + x % 2]);
          CHECK(again_left[i] == left[i * static_cast<size_t>(channels) + colour]);
          CHECK(again_right[i] == right[i * static_cast<size_t>(channels) + colour]);
        }
      }
    }
  }
}

TEST_CASE("frame codec: names and codes") {
  CHECK(frame_format("y16") == FrameFormat::y16);
  CHECK(frame_format("grey") == FrameFormat::grey);
  CHECK_FALSE(frame_format("jpeg"));
  CHECK(mosaic("gbrg") == Mosaic::gbrg);
  CHECK_FALSE(mosaic("rgb"));
  CHECK(four_characters_text(four_characters(FrameFormat::y16)) == "Y16 ");
  CHECK(four_characters_text(four_characters(FrameFormat::rgb3)) == "RGB3");
  CHECK(four_characters_text(0x01020304) == "????");
}
