// SPDX-License-Identifier: Apache-2.0
// A message as the page shows it: binary frames of graph/web/README.md.
#pragma once
#include <string>
#include <vector>

#include "graph/web/hub.hpp"
#include "rt/msg/field.hpp"

namespace takt::web {

/// Whose message it is, for the header of a frame.
struct Origin {
  std::string port;
  uint64_t sequence = 0;
  int64_t stamp_ns = 0, epoch_ns = 0;
  int32_t level = 0;
  double age_ms = 0;
};

/// What messages of that type can be seen as, beside their fields: of "picture", "disparity", "cloud", "scan", "grid"
/// and "pose". A specimen is asked.
std::vector<std::string> kinds_of(const MessageType& type, const Capacity& capacity);

/// Frames of that kind; none: the message shows nothing of it. `message` is sound. Takes as long as a JPEG.
std::vector<Hub::Part> page_frames(const MessageType& type, const void* message, const std::string& kind,
                                   const Origin& origin);

}  // namespace takt::web
