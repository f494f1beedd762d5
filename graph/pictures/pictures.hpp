// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/pictures.hpp>: ace, experimental.
// Lets a program of your own draw images, grids and clouds for `echo --png` and `echo --ply`. With it the program links
// OpenCV.
//
//   takt::main(argc, argv, [](takt::Registry& registry) {
//     register_robot(registry);
//     takt::register_pictures(registry);
//   });
#pragma once
#include <optional>
#include <string>

#include "graph/language/registry.hpp"
#include "rt/msg/field.hpp"

namespace takt {

/// The message as a PNG file: images as they are, stereo pairs side by side, disparities and grids in false colours.
/// Nothing if its type cannot be seen.
std::optional<std::string> message_png(const MessageType& type, const void* message);

/// A point cloud as a binary PLY file, in the frame of its sensor. Nothing if the message is none.
std::optional<std::string> message_ply(const MessageType& type, const void* message);

void register_pictures(Registry& registry);

}  // namespace takt
