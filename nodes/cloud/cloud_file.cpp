// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cloud_file.hpp"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "rt/file/output_file.hpp"
#include "rt/msg/point.hpp"

namespace takt::cloud {
namespace {

static_assert(std::endian::native == std::endian::little, "binary files are written as they lie in memory");

uint32_t packed(const Colour& c) {
  return static_cast<uint32_t>(c.r) << 16 | static_cast<uint32_t>(c.g) << 8 | static_cast<uint32_t>(c.b);
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string reason() {
  return errno != 0 ? std::generic_category().message(errno) : std::string("cannot be read or written");
}

}  // namespace

tl::expected<Cloud, std::string> read_cloud(const std::filesystem::path& file) {
  std::error_code failed;
  const auto size = std::filesystem::file_size(file, failed);
  if (failed) return tl::make_unexpected(fmt::format("{}: {}", file.string(), failed.message()));
  std::string bytes(size, '\0');
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    return tl::make_unexpected(fmt::format("{}: {}", file.string(), reason()));
  return parse_cloud(bytes, file.string());
}

std::string ply_of(const CloudView& cloud, Encoding encoding) {
  const bool ascii = encoding == Encoding::ascii;
  std::string out = fmt::format(
      "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n",
      ascii ? "ascii" : "binary_little_endian", cloud.points.size(),
      cloud.coloured() ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "");
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Point& p = cloud.points[i];
    const Colour c = cloud.coloured() ? cloud.colours[i] : Colour{};
    if (ascii) {
      fmt::format_to(std::back_inserter(out), "{} {} {}", p.x, p.y, p.z);
      if (cloud.coloured()) fmt::format_to(std::back_inserter(out), " {} {} {}", c.r, c.g, c.b);
      out += '\n';
    } else {
      append(out, p);
      if (cloud.coloured()) out += {static_cast<char>(c.r), static_cast<char>(c.g), static_cast<char>(c.b)};
    }
  }
  return out;
}

std::string pcd_of(const CloudView& cloud, Encoding encoding) {
  const bool ascii = encoding == Encoding::ascii, coloured = cloud.coloured();
  // As the Point Cloud Library does it: a packed colour is a float in binary files and a whole number in text, where a
  // float would lose what is not a number.
  std::string out = fmt::format(
      "VERSION 0.7\nFIELDS x y z{}\nSIZE 4 4 4{}\nTYPE F F F{}\nCOUNT 1 1 1{}\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 "
      "0 0\nPOINTS {}\nDATA {}\n",
      coloured ? " rgb" : "", coloured ? " 4" : "", coloured ? (ascii ? " U" : " F") : "", coloured ? " 1" : "",
      cloud.points.size(), cloud.points.size(), ascii ? "ascii" : "binary");
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Point& p = cloud.points[i];
    if (ascii) {
      fmt::format_to(std::back_inserter(out), "{} {} {}", p.x, p.y, p.z);
      if (coloured) fmt::format_to(std::back_inserter(out), " {}", packed(cloud.colours[i]));
      out += '\n';
    } else {
      append(out, p);
      if (coloured) append(out, packed(cloud.colours[i]));
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
