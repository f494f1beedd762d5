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

/// The message as a PNG file, as it shows itself (rt/msg/viewer.hpp): images as they are, those of a stereo pair side
/// by side, disparities and grids in false colours, clouds from above and from the side. Nothing if it shows none of
/// these, or is not sound.
std::optional<std::string> message_png(const MessageType& type, const void* message);

/// The point cloud that the message shows, as a binary PLY file, in the frame of its sensor. Nothing if it shows none.
std::optional<std::string> message_ply(const MessageType& type, const void* message);

void register_pictures(Registry& registry);

}  // namespace takt
