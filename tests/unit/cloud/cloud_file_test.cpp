// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cloud_file.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "rt/msg/point.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt::cloud;
using takt::Colour;
using takt::Point;

namespace {

Cloud parsed(const std::string& bytes) {
  auto cloud = parse_cloud(bytes, "a");
  REQUIRE_MESSAGE(cloud.has_value(), cloud.error());
  return *cloud;
}

std::string error_of(const std::string& bytes) {
  const auto cloud = parse_cloud(bytes, "a");
  REQUIRE_FALSE(cloud.has_value());
  return cloud.error();
}

template <class... Values>
std::string raw(const Values&... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

const Cloud kCloud{{{1.5f, -2, 1e-20f}, {0.1f, std::numeric_limits<float>::infinity(), 3}}, {{1, 2, 3}, {255, 128, 0}}};

void check_same(const Cloud& a, const Cloud& b) {
  REQUIRE(a.points.size() == b.points.size());
  REQUIRE(a.colours.size() == b.colours.size());
  CHECK(std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Point)) == 0);
  for (size_t i = 0; i < a.colours.size(); ++i) CHECK(std::memcmp(&a.colours[i], &b.colours[i], sizeof(Colour)) == 0);
}

}  // namespace

TEST_CASE("what is written comes back, bit for bit: PLY and PCD, ASCII and binary, with and without colours") {
  const takt::test::TemporaryFolder folder;
  for (const char* name : {"cloud.ply", "cloud.pcd"})
    for (const Encoding encoding : {Encoding::ascii, Encoding::binary})
      for (const bool coloured : {true, false}) {
        CAPTURE(name);
        Cloud cloud = kCloud;
        if (!coloured) cloud.colours.clear();
        REQUIRE(write_cloud(folder.path / name, cloud.view(), encoding));
        const auto back = read_cloud(folder.path / name);
        REQUIRE_MESSAGE(back.has_value(), back.error());
        check_same(*back, cloud);
      }
}

TEST_CASE("a PLY file may hold more than points and colours") {
  const Cloud text = parsed(
      "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info x\r\n"
      "element face 2\r\nproperty list uchar int vertex_index\r\n"
      "element vertex 2\r\nproperty double nx\r\nproperty float z\r\nproperty float x\r\nproperty float y\r\n"
      "property uchar blue\r\nproperty uchar green\r\nproperty uchar red\r\nproperty list uchar float w\r\n"
      "element edge 7\r\nproperty int a\r\nend_header\r\n"
      "3 0 1 2\r\n0\r\n"
      "7e300 3 1 2 6 5 4 2 0 0\r\n\r\n  -1 +6\t4 nan 9 8 7 0\r\nwhatever\r\n");
  REQUIRE(text.points.size() == 2);
  CHECK(text.points[0].x == 1);
  CHECK(text.points[0].y == 2);
  CHECK(text.points[0].z == 3);
  CHECK(text.colours[0].r == 4);
  CHECK(text.colours[1].b == 9);
  CHECK(std::isnan(text.points[1].y));
  CHECK(text.points[1].z == 6);

  const Cloud binary = parsed(
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar ushort i\n"
      "element vertex 1\nproperty float64 x\nproperty list int8 int16 w\nproperty int16 y\nproperty float32 z\n"
      "end_header\n" +
      raw(uint8_t{2}, uint16_t{1}, uint16_t{2}) + raw(1.25, int8_t{1}, int16_t{7}, int16_t{-2}, 3.5f));
  REQUIRE(binary.points.size() == 1);
  CHECK(binary.points[0].x == 1.25f);
  CHECK(binary.points[0].y == -2);
  CHECK(binary.points[0].z == 3.5f);
  CHECK(binary.colours.empty());
}

TEST_CASE("a PCD file may be organised, have more fields, and pack its colours in three ways") {
  const std::string head = "# .PCD v.7\nVERSION .7\n";
  const Cloud text = parsed(head +
                            "COLUMNS normal x y z rgb\nSIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 3 1 1 1 1\nWIDTH 2\n"
                            "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
                            "0 0 1 1 2 3 4.2108e+06\n0 0 1 nan nan nan 0\n");
  REQUIRE(text.colours.size() == 2);  // 4210800 as a float has the bits 4A 80 80 E0
  CHECK(text.colours[0].r == 0x80);
  CHECK(text.colours[0].g == 0x80);
  CHECK(text.colours[0].b == 0xE0);
  CHECK(std::isnan(text.points[1].x));

  const std::string fields = "FIELDS x y z rgba\nSIZE 4 4 4 4\nCOUNT 1 1 1 1\n";
  const Cloud whole = parsed(fields + "TYPE F F F U\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3 4278321411\n");
  CHECK(whole.colours[0].r == 2);  // FF 02 01 03
  CHECK(whole.colours[0].g == 1);
  CHECK(whole.colours[0].b == 3);
  const Cloud negative = parsed(fields + "TYPE F F F I\nWIDTH 1\nDATA ascii\n1 2 3 -16645885\n");
  CHECK(negative.colours[0].r == 2);
  // A colour whose bits are no number as a float, which a conversion would change.
  const Cloud bits = parsed(fields + "TYPE F F F F\nPOINTS 1\nDATA binary\n" + raw(1.f, 2.f, 3.f, 0xFF810203u));
  CHECK(bits.colours[0].r == 0x81);
  CHECK(bits.colours[0].b == 3);
}

TEST_CASE("errors name the place and what was expected there") {
  const std::string ply = "ply\nformat ascii 1.0\n", vertex = "element vertex 2\nproperty float x\nproperty float y\n";
  const std::string xyz = vertex + "property float z\nend_header\n";
  CHECK(error_of("") == "a:1: the file ends, expected the first line of a PLY or PCD file");
  CHECK(error_of("\x01pl\xff\n") ==
        "a:1: `?pl?`, expected FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA ascii or DATA binary");
  CHECK(error_of("ply\nformat binary_big_endian 1.0\n") ==
        "a:2: format binary_big_endian, expected ascii or binary_little_endian");
  CHECK(error_of(ply + "element vertex many\n") == "a:3: `many`, expected a count");
  CHECK(error_of(ply + "element vertex 2\nproperty real x\n") ==
        "a:4: `real`, expected a type: char, uchar, short, ushort, int, uint, float, double");
  CHECK(error_of(ply + "end_header\n") == "a:3: the header ends without `element vertex`");
  CHECK(error_of("ply\n" + xyz) ==
        "a:6: the header ends without a line `format`, expected ascii or binary_little_endian");
  CHECK(error_of(ply + vertex + "end_header\n1 2\n3 4\n") == "a:6: vertex has no column z, expected x, y and z");
  CHECK(error_of(ply + xyz + "1 2 3\n1 2\n") == "a:9: 2 values, expected more");
  CHECK(error_of(ply + xyz + "1 2 3\n1 2 3 4\n") == "a:9: 4 values, expected 3");
  CHECK(error_of(ply + xyz + "1 2 3\n1 x 3\n") == "a:9: `x`, expected a number");
  CHECK(error_of(ply + xyz + "1 2\n") == "a:7: 2 rows of 3 values were announced, 4 bytes follow");
  CHECK(error_of(ply + xyz + "1 2 3333333\n") == "a:9: the file ends, expected another row of values");
  CHECK(error_of("ply\nformat binary_little_endian 1.0\n" + xyz + raw(1.f, 2.f, 3.f, 4.f, uint8_t{5})) ==
        "a: byte 131: 1 bytes left, expected 4 more for the next value");
  CHECK(error_of(ply + "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
                       "property uchar green\nproperty uchar blue\nend_header\n1 2 3 4 5 256\n") ==
        "a:11: `256`, expected a whole number in 0..255");
  CHECK(error_of("FIELDS x y z\nSIZE 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n") ==
        "a:5: 3 FIELDS, 2 SIZEs, 3 TYPEs, 3 COUNTs, expected as many of each");
  CHECK(error_of("FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nWIDTH 1\nDATA ascii\n") ==
        "a:5: TYPE F of SIZE 3, expected F of 4 or 8, or I or U of 1, 2, 4 or 8");
  CHECK(error_of("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 3\nHEIGHT 2\nPOINTS 5\nDATA ascii\n") ==
        "a:7: 5 POINTS, expected WIDTH times HEIGHT, 3 times 2");
  CHECK(
      error_of("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nDATA binary_compressed\n") ==
      "a:4: `DATA binary_compressed`, expected FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA ascii "
      "or DATA binary");
}

TEST_CASE("files that cannot be read or written are named") {
  const takt::test::TemporaryFolder folder;
  CHECK(read_cloud(folder.path / "none.ply").error() ==
        (folder.path / "none.ply").string() + ": No such file or directory");
  CHECK(read_cloud(folder.path).error() == folder.path.string() + ": Is a directory");
  CHECK(write_cloud(folder.path / "a.txt", kCloud.view()).error() ==
        (folder.path / "a.txt").string() + ": clouds are written to files ending in .ply or .pcd");
  CHECK(write_cloud(folder.path / "none" / "a.ply", kCloud.view()).error() ==
        (folder.path / "none" / "a.ply").string() + ": No such file or directory; choose another place");
}
