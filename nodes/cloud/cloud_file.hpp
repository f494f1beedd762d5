// SPDX-License-Identifier: Apache-2.0
// Clouds in files: PLY and PCD, ASCII or binary. For tools, never in a job.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "nodes/cloud/cloud.hpp"

namespace takt::cloud {

/// Binary is little endian.
enum class Encoding : uint8_t { binary, ascii };

/// Reads PLY and PCD files of any writer: text, binary of either byte order, binary_compressed; from a pipe, too.
///
///     const auto cloud = read_cloud("scan.ply");
///     if (cloud) for (const std::string& left : cloud->left_out) std::puts(left.c_str());
///
/// Of a PLY file it takes element `vertex` with x, y, z and, if it has them, red, green, blue (also r, g, b and
/// diffuse_red ...; bytes, 16 bits or floats), of a PCD file fields x, y, z and, if it has it, rgb or rgba (packed, F 4
/// or U 4). Which of the two it is says the file, not its name. What is passed over or converted stands in `left_out`;
/// a point may be NaN. Coordinates beyond 4 km come with an `origin`. Error: "FILE:LINE: ..." or, in binary data,
/// "FILE: byte N: ...", with what was expected there.
tl::expected<Cloud, std::string> read_cloud(const std::filesystem::path& file);
/// The same from memory; `name` stands for the file in errors.
tl::expected<Cloud, std::string> parse_cloud(std::string_view bytes, const std::string& name);

/// For those who need all points in one frame: adds the origin to the points. Returns what that costs, as a sentence;
/// empty if there was none.
std::string add_origin(Cloud& cloud);

/// As the name ends: .ply or .pcd. With colours if the cloud has them; with an origin as doubles, the origin
/// added. Error: another ending, or the file cannot be
/// written.
tl::expected<void, std::string> write_cloud(const std::filesystem::path& file, const CloudView& cloud,
                                            Encoding encoding = Encoding::binary);
std::string ply_of(const CloudView& cloud, Encoding encoding);
std::string pcd_of(const CloudView& cloud, Encoding encoding);

}  // namespace takt::cloud
