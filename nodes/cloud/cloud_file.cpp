// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cloud_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "rt/file/output_file.hpp"
#include "rt/msg/point.hpp"

namespace takt::cloud {
namespace {

constexpr uint64_t kLargestFile = uint64_t{1} << 32;
constexpr size_t kPiece = 1 << 20;

static_assert(std::endian::native == std::endian::little, "binary files are written as they lie in memory");

uint32_t packed(const Colour& c) {
  return static_cast<uint32_t>(c.r) << 16 | static_cast<uint32_t>(c.g) << 8 | static_cast<uint32_t>(c.b);
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Of a cloud with an origin as doubles, where it belongs.
void append_point(std::string& out, const CloudView& cloud, size_t i, bool ascii) {
  const Point& p = cloud.points[i];
  if (cloud.origin == std::array<double, 3>{}) {
    if (ascii) fmt::format_to(std::back_inserter(out), "{} {} {}", p.x, p.y, p.z);
    else append(out, p);
    return;
  }
  // To a micrometre: what the float lacks behind that is no digit of the file that it came from.
  const auto absolute = [&](float value, size_t axis) {
    return std::round((static_cast<double>(value) + cloud.origin[axis]) * 1e6) / 1e6;
  };
  const std::array<double, 3> at{absolute(p.x, 0), absolute(p.y, 1), absolute(p.z, 2)};
  if (ascii) fmt::format_to(std::back_inserter(out), "{} {} {}", at[0], at[1], at[2]);
  else append(out, at);
}

std::string reason() {
  return errno != 0 ? std::generic_category().message(errno) : std::string("cannot be read or written");
}

}  // namespace

tl::expected<Cloud, std::string> read_cloud(const std::filesystem::path& file) {
  const auto wrong = [&](const std::string& what) {
    return tl::make_unexpected(fmt::format("{}: {}", file.string(), what));
  };
  std::error_code failed;
  if (const auto size = std::filesystem::file_size(file, failed); !failed && size > kLargestFile)
    return wrong(fmt::format("has {} bytes, at most {} are read; divide it", size, kLargestFile));
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) return wrong(reason());
  std::string bytes;  // in pieces: a pipe has no size
  std::vector<char> piece(kPiece);
  do {
    in.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    bytes.append(piece.data(), static_cast<size_t>(in.gcount()));
  } while (in && bytes.size() <= kLargestFile);
  if (in.bad()) return wrong(reason());
  if (bytes.size() > kLargestFile) return wrong(fmt::format("is longer than {} bytes; divide it", kLargestFile));
  return parse_cloud(bytes, file.string());
}

std::string add_origin(Cloud& cloud) {
  if (cloud.origin == std::array<double, 3>{}) return "";
  float largest = 0;
  for (Point& p : cloud.points) {
    const auto add = [&](float& value, double origin) {
      value = static_cast<float>(static_cast<double>(value) + origin);
      if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
    };
    add(p.x, cloud.origin[0]), add(p.y, cloud.origin[1]), add(p.z, cloud.origin[2]);
  }
  cloud.origin = {};
  return fmt::format("coordinates of up to {:.0f} m are rounded to steps of {} m", largest,
                     std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest);
}

std::string ply_of(const CloudView& cloud, Encoding encoding) {
  const bool ascii = encoding == Encoding::ascii, far = cloud.origin != std::array<double, 3>{};
  const char* const type = far ? "double" : "float";
  std::string out =
      fmt::format("ply\nformat {} 1.0\nelement vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\n{}end_header\n",
                  ascii ? "ascii" : "binary_little_endian", cloud.points.size(), type, type, type,
                  cloud.coloured() ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "");
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Colour c = cloud.coloured() ? cloud.colours[i] : Colour{};
    append_point(out, cloud, i, ascii);
    if (ascii) {
      if (cloud.coloured()) fmt::format_to(std::back_inserter(out), " {} {} {}", c.r, c.g, c.b);
      out += '\n';
    } else if (cloud.coloured()) {
      out += {static_cast<char>(c.r), static_cast<char>(c.g), static_cast<char>(c.b)};
    }
  }
  return out;
}

std::string pcd_of(const CloudView& cloud, Encoding encoding) {
  const bool ascii = encoding == Encoding::ascii, coloured = cloud.coloured();
  const int size = cloud.origin != std::array<double, 3>{} ? 8 : 4;
  // As the Point Cloud Library does it: a packed colour is a float in binary files and a whole number in text, where a
  // float would lose what is not a number.
  std::string out = fmt::format(
      "VERSION 0.7\nFIELDS x y z{}\nSIZE {} {} {}{}\nTYPE F F F{}\nCOUNT 1 1 1{}\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 "
      "1 0 "
      "0 0\nPOINTS {}\nDATA {}\n",
      coloured ? " rgb" : "", size, size, size, coloured ? " 4" : "", coloured ? (ascii ? " U" : " F") : "",
      coloured ? " 1" : "", cloud.points.size(), cloud.points.size(), ascii ? "ascii" : "binary");
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    append_point(out, cloud, i, ascii);
    if (ascii) {
      if (coloured) fmt::format_to(std::back_inserter(out), " {}", packed(cloud.colours[i]));
      out += '\n';
    } else if (coloured) {
      append(out, packed(cloud.colours[i]));
    }
  }
  return out;
}

tl::expected<void, std::string> write_cloud(const std::filesystem::path& file, const CloudView& cloud,
                                            Encoding encoding) {
  const std::string ending = file.extension().string();
  if (ending != ".ply" && ending != ".pcd")
    return tl::make_unexpected(fmt::format("{}: clouds are written to files ending in .ply or .pcd", file.string()));
  if (const auto done = write_file(file, ending == ".ply" ? ply_of(cloud, encoding) : pcd_of(cloud, encoding)); !done)
    return tl::make_unexpected(done.error().what + "; choose another place");
  return {};
}

}  // namespace takt::cloud
