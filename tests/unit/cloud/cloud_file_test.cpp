// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cloud_file.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
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
        "a:1: `?pl?`, expected FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA ascii, DATA binary or "
        "DATA binary_compressed");
  CHECK(error_of("ply\nformat binary_middle_endian 1.0\n") ==
        "a:2: format binary_middle_endian, expected ascii, binary_little_endian or binary_big_endian");
  CHECK(error_of(ply + "element vertex many\n") == "a:3: `many`, expected a count");
  CHECK(error_of(ply + "element vertex 2\nproperty real x\n") ==
        "a:4: `real`, expected a type: char, uchar, short, ushort, int, uint, float, double");
  CHECK(error_of(ply + "end_header\n") == "a:3: the header ends without `element vertex`");
  CHECK(error_of("ply\n" + xyz) ==
        "a:6: the header ends without a line `format`, expected ascii, binary_little_endian or binary_big_endian");
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
  CHECK(error_of("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nDATA packed\n") ==
        "a:4: `DATA packed`, expected FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA ascii, DATA "
        "binary or DATA binary_compressed");
}

namespace {

std::string swapped(std::string bytes) {
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

bool reports(const Cloud& cloud, const std::string& words) {
  return std::any_of(cloud.left_out.begin(), cloud.left_out.end(),
                     [&](const std::string& left) { return left.find(words) != std::string::npos; });
}

std::string ply(const std::string& columns, const std::string& rows, int count = 1) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
         "\nproperty float x\nproperty float y\nproperty float z\n" + columns + "end_header\n" + rows;
}

std::string colours(const std::string& type, const std::string& r, const std::string& g, const std::string& b) {
  return "property " + type + " " + r + "\nproperty " + type + " " + g + "\nproperty " + type + " " + b + "\n";
}

void check_colour(const Cloud& cloud, int r, int g, int b) {
  REQUIRE(cloud.colours.size() == cloud.points.size());
  CHECK(cloud.colours[0].r == r);
  CHECK(cloud.colours[0].g == g);
  CHECK(cloud.colours[0].b == b);
}

}  // namespace

TEST_CASE("colours of other programs: names, floats, 16 bits, 255.0; what cannot be used costs the colours alone") {
  check_colour(parsed(ply(colours("uchar", "diffuse_red", "diffuse_green", "diffuse_blue"), "0 0 1 10 20 30\n")), 10,
               20, 30);
  check_colour(parsed(ply(colours("uchar", "r", "g", "b"), "0 0 1 10 20 30\n")), 10, 20, 30);
  check_colour(parsed(ply(colours("uchar", "Red", "Green", "Blue"), "0 0 1 255.0 0.0 3.0\n")), 255, 0, 3);
  const Cloud floats = parsed(ply(colours("float", "red", "green", "blue"), "0 0 1 0.5 0.2 1\n"));
  check_colour(floats, 128, 51, 255);
  CHECK(reports(floats, "values of 0 to 1,"));
  check_colour(parsed(ply(colours("double", "red", "green", "blue"), "0 0 1 200 7 1\n")), 200, 7, 1);
  const Cloud wide = parsed(ply(colours("ushort", "red", "green", "blue"), "0 0 1 257 25700 65535\n"));
  check_colour(wide, 1, 100, 255);
  CHECK(reports(wide, "values of 0 to 65535"));
  const Cloud beyond = parsed(ply(colours("float", "red", "green", "blue"), "0 0 1 -0.5 nan 1\n"));
  check_colour(beyond, 0, 0, 255);
  CHECK(reports(beyond, "2 values of colours lie outside"));
  const Cloud none = parsed(
      ply("property uchar red\nproperty ushort green\nproperty uchar blue\nproperty float nx\n", "0 0 1 1 2 3 4\n"));
  CHECK(none.colours.empty());
  CHECK(reports(none, "columns that are not read: nx, red, green, blue"));
}

TEST_CASE("numbers of other programs: denormals, rows that are not lines, a byte order mark, blanks, big endian") {
  const Cloud small = parsed(ply("", "1e-46 -1e-400 1\n"));
  CHECK(small.points[0].x == 0);
  CHECK(small.points[0].z == 1);
  const Cloud stream = parsed(ply("", "0 0 1 0 0.1\n1 0.1 0 1", 3));
  CHECK(stream.points[1].y == 0.1f);
  CHECK(reports(stream, "rows are not lines"));
  CHECK(parsed(ply("element face 1\nproperty list uchar int i\n", "0 0 1 0 0 2\n3 0 1 1\n", 2)).points.size() == 2);
  // A row too long is no stream: it would not come out even.
  CHECK(error_of(ply("", "0 0 1\n0 0 1 7\n", 2)).find("4 values, expected 3") != std::string::npos);
  CHECK(parsed("\xEF\xBB\xBF" + ply("", "0 0 1\n")).points.size() == 1);
  std::string blank = ply("", "0 0 1 \n");
  CHECK(parsed(blank.insert(3, " ")).points.size() == 1);
  const Cloud big = parsed(
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty double y\n"
      "property short z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n" +
      swapped(raw(1.5f)) + swapped(raw(-2.25)) + swapped(raw(int16_t{300})) + raw(uint8_t{1}, uint8_t{2}, uint8_t{3}));
  CHECK(big.points[0].x == 1.5f);
  CHECK(big.points[0].y == -2.25f);
  CHECK(big.points[0].z == 300);
  check_colour(big, 1, 2, 3);
}

TEST_CASE("binary_compressed PCD: columns by LZF; damage is noticed") {
  // Two points: x 1 1, y 2 2, z 3 3; the second of each column repeats the first (4 bytes back).
  std::string packed;
  for (const float value : {1.f, 2.f, 3.f}) packed += char{3} + raw(value) + std::string{char{0x40}, char{3}};
  const std::string head =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary_compressed\n";
  const std::string whole = head + raw(static_cast<uint32_t>(packed.size()), uint32_t{24}) + packed;
  const Cloud cloud = parsed(whole);
  REQUIRE(cloud.points.size() == 2);
  for (const Point& p : cloud.points) {
    CHECK(p.x == 1);
    CHECK(p.y == 2);
    CHECK(p.z == 3);
  }
  CHECK(error_of(head + raw(uint32_t{7}, uint32_t{25}) + packed).find("25 bytes of columns, expected 2 rows of 12") !=
        std::string::npos);
  CHECK(error_of(whole.substr(0, whole.size() - 1)).find("packed bytes were announced") != std::string::npos);
  for (size_t i = 0; i < packed.size(); ++i) {  // any control byte: refused, or other numbers, never beyond the memory
    std::string damaged = whole;
    damaged[whole.size() - 1 - i] = static_cast<char>(0xFF);
    static_cast<void>(parse_cloud(damaged, "a"));
  }
}

TEST_CASE("coordinates of surveyors keep their millimetres: an origin is taken off and carried along") {
  const takt::test::TemporaryFolder folder;
  const std::string head = "element vertex 2\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
  const double x = 512345.123, y = 5312345.678;
  const std::string binary = "ply\nformat binary_little_endian 1.0\n" + head + raw(x, y, 1.5, x + 0.01, y, 1.5);
  const std::string text =
      "ply\nformat ascii 1.0\n" + head + "512345.123 5312345.678 1.5\n512345.133 5312345.678 1.5\n";
  for (const std::string& bytes : {binary, text})
    for (const char* name : {"far.ply", "far.pcd"})
      for (const Encoding encoding : {Encoding::ascii, Encoding::binary}) {
        Cloud cloud = parsed(bytes);
        CHECK(cloud.origin == std::array<double, 3>{512345, 5312345, 0});
        REQUIRE(write_cloud(folder.path / name, cloud.view(), encoding));
        const auto back = read_cloud(folder.path / name);
        REQUIRE(back);
        CHECK(back->origin == cloud.origin);
        CHECK(std::abs(static_cast<double>(back->points[1].x) - 0.133) < 1e-5);
        CHECK(std::abs(static_cast<double>(back->points[1].y) - 0.678) < 1e-5);
        CHECK(back->points[1].z == 1.5f);
        CHECK(add_origin(cloud).find("rounded to steps of 0.5 m") != std::string::npos);
        CHECK(cloud.points[0].y == 5312345.5f);
      }
  const Cloud floats = parsed(
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n" +
      raw(1.f, 5312345.678f, 0.f));
  CHECK(reports(floats, "steps of 0.5 m in the file itself"));
  CHECK(reports(parsed(ply("", "0 0 1\nnan 0 1\n1e5 0 1\n2e5 0.1 1\n0.1 0 1\n", 5)), "1 points are not finite"));
  Cloud near = parsed(ply("", "0 0 1\n"));
  CHECK(near.origin == std::array<double, 3>{});
  CHECK(add_origin(near).empty());
}

TEST_CASE("a cloud from a pipe") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const std::string bytes = ply("", "0 0 1\n");
  REQUIRE(write(ends[1], bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  close(ends[1]);
  CHECK(read_cloud("/dev/fd/" + std::to_string(ends[0])).has_value());
  close(ends[0]);
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
