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

/// Reads what write_cloud writes and what others write that way: of a PLY file element `vertex` with x, y, z and, if it
/// has them, red, green, blue (uchar); of a PCD file fields x, y, z and, if it has it, rgb or rgba (packed, F 4 or U
/// 4). Which of the two it is says the file, not its name. Other columns and elements are passed over; a point may be
/// NaN. Error: "FILE:LINE: ..." or, in binary data, "FILE: byte N: ...", with what was expected there.
tl::expected<Cloud, std::string> read_cloud(const std::filesystem::path& file);
/// The same from memory; `name` stands for the file in errors.
tl::expected<Cloud, std::string> parse_cloud(std::string_view bytes, const std::string& name);

/// As the name ends: .ply or .pcd. With colours if the cloud has them. Error: another ending, or the file cannot be
/// written.
tl::expected<void, std::string> write_cloud(const std::filesystem::path& file, const CloudView& cloud,
                                            Encoding encoding = Encoding::binary);
std::string ply_of(const CloudView& cloud, Encoding encoding);
std::string pcd_of(const CloudView& cloud, Encoding encoding);

}  // namespace takt::cloud
