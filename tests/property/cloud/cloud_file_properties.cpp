// SPDX-License-Identifier: Apache-2.0
// Damaged files: nothing crashes, every failure names a line or a byte.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <string_view>

#include "nodes/cloud/cloud_file.hpp"
#include "tests/property_scale.hpp"

using namespace takt::cloud;

namespace {

std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random); };
  static const std::string kWords[] = {
      "ply",   "vertex", "18446744073709551615", "-1",           "1e999", "nan", "list uchar", "binary", "ascii", "\n",
      "COUNT", "0",      "4294967296",           "end_header\n", "rgb"};
  for (size_t edits = 1 + below(4); edits > 0 && !bytes.empty(); --edits) {
    const size_t at = below(bytes.size()), length = std::min(1 + below(12), bytes.size() - at);
    switch (below(6)) {
      case 0: bytes.erase(at, length); break;
      case 1: bytes.insert(below(bytes.size()), bytes.substr(at, length)); break;
      case 2: bytes[at] = static_cast<char>(random()); break;
      case 3: bytes.resize(at); break;
      case 4: bytes.insert(at, kWords[below(std::size(kWords))]); break;
      default: {  // a word of the header for another one
        const size_t start = bytes.find_last_of(" \n", at) + 1,
                     end = std::min(bytes.find_first_of(" \n", at), bytes.size());
        bytes.replace(start, end > start ? end - start : 0, kWords[below(std::size(kWords))]);
      }
    }
  }
  return bytes;
}

/// "file:LINE: WHY" or "file: byte NUMBER: WHY", in printable characters.
bool has_place(std::string_view error) {
  for (const std::string_view before : {"file:", "file: byte "}) {
    if (!error.starts_with(before)) continue;
    const std::string_view place = error.substr(before.size());
    const size_t colon = place.find_first_not_of("0123456789");
    if (colon == 0 || colon == std::string_view::npos) continue;
    const std::string_view why = place.substr(colon);
    return why.size() > 2 && why.starts_with(": ") &&
           std::all_of(why.begin(), why.end(), [](char c) { return c >= ' ' && c <= '~'; });
  }
  return false;
}

/// What parse_cloud answers is a cloud that is whole, or an error with a place.
bool check(const std::string& bytes) {
  const auto cloud = parse_cloud(bytes, "file");
  if (cloud) CHECK((cloud->colours.empty() || cloud->colours.size() == cloud->points.size()));
  else CHECK_MESSAGE(has_place(cloud.error()), cloud.error());
  return cloud.has_value();
}

}  // namespace

TEST_CASE("no damage to a file crashes the reader, and every failure carries its place") {
  std::mt19937 random(takt::test::seed(3));
  Cloud cloud;
  for (int i = 0; i < 6; ++i) {
    cloud.points.push_back({static_cast<float>(i), -0.5f, 1e-3f});
    cloud.colours.push_back({1, 200, static_cast<uint8_t>(i)});
  }
  std::vector<std::string> whole{
      "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int i\nelement vertex 1\nproperty float x\nproperty "
      "double y\nproperty int z\nproperty list char float w\nend_header\n3 0 1 2\n1 5\n1 2 3 2 7 8\n",
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 1\nproperty "
      "list "
      "uint short w\nproperty char x\nproperty char y\nproperty char z\nend_header\n" +
          std::string("\1\0\0\0\0\2\0\0\0\0\0\0\0\1\2\3", 16)};
  for (const Encoding encoding : {Encoding::ascii, Encoding::binary})
    for (const auto& write : {ply_of, pcd_of}) whole.push_back(write(cloud.view(), encoding));
  for (const std::string& bytes : whole) REQUIRE(check(bytes));
  size_t refused = 0;
  const size_t rounds = takt::test::rounds(size_t{12000});
  for (size_t i = 0; i < rounds; ++i) {
    const std::string bytes = mutated(whole[i % whole.size()], random);
    CAPTURE(bytes);
    refused += check(bytes) ? 0 : 1;
  }
  CHECK(refused > rounds / 3);
  CHECK(refused < rounds);
}

TEST_CASE("a file cut off anywhere is refused") {
  const Cloud cloud{{{1, 2, 3}, {4, 5, 6}}, {{7, 8, 9}, {10, 11, 12}}};
  for (const auto& write : {ply_of, pcd_of})
    for (const Encoding encoding : {Encoding::ascii, Encoding::binary}) {
      const std::string bytes = write(cloud.view(), encoding);
      // The last number of a text may lose digits: it is another number then.
      const size_t whole = encoding == Encoding::ascii ? bytes.find_last_of(' ') + 2 : bytes.size();
      for (size_t size = 0; size < whole; ++size) CHECK_FALSE(check(bytes.substr(0, size)));
      CHECK(check(bytes));
    }
}

TEST_CASE("random bytes are refused") {
  std::mt19937 random(takt::test::seed(5));
  for (int i = 0; i < takt::test::rounds(2000); ++i) {
    std::string bytes = i % 3 == 0 ? "ply\n" : i % 3 == 1 ? "FIELDS x y z\n" : "";
    for (size_t n = random() % 300; n > 0; --n) bytes += static_cast<char>(random());
    CHECK_FALSE(check(bytes));
  }
}
