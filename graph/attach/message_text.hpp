// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "hal/settings/json.hpp"
#include "rt/msg/field.hpp"

namespace takt::attach {

/// A message as one JSON object by its field descriptors: scalars as numbers, texts as text, of longer arrays the size
/// and the first `items` elements.
nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items = 8);

/// The same of a message as a record holds it (rt/record/packed_message.hpp). Error: it is cut off or too long.
tl::expected<nlohmann::ordered_json, std::string> packed_json(std::span<const Field> fields,
                                                              std::span<const std::byte> packed, size_t items = 8);

/// The message as a PNG file, as it shows itself (rt/msg/viewer.hpp): images as they are, those of a stereo pair side
/// by side, disparities and grids in false colours, clouds from above and from the side. Nothing if it shows none of
/// these, or is not sound.
std::optional<std::string> message_png(const MessageType& type, const void* message);

/// The point cloud that the message shows, as a binary PLY file, in the frame of its sensor. Nothing if it shows none.
std::optional<std::string> message_ply(const MessageType& type, const void* message);

}  // namespace takt::attach
