// SPDX-License-Identifier: Apache-2.0
// The object database: a folder with a list, objects.txt, and the reference views it names (algorithm reference 6.8).
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// An object cut out on black: 8-bit BGR, (0, 0, 0) is background.
struct ReferenceView {
  std::filesystem::path file;
  int side_px = 0;
  std::vector<uint8_t> pixels;
  std::optional<double> threshold;  ///< of this view; none: the object's

  ImageView<const uint8_t> view() const { return {pixels.data(), side_px, side_px, 3}; }
};

struct DatabaseObject {
  std::string name;
  std::optional<double> threshold;  ///< none: automatic_threshold
  std::vector<ReferenceView> views;
  std::vector<ReferenceView> test_views;  ///< for measurements, never compared with
};

/// What cannot be used: "FILE:LINE: what is wrong; what is valid".
struct DatabaseError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class TestViews : uint8_t { skip, read };

/// Reads `folder`/objects.txt and the views it names, each `side_px` x `side_px`. A line holds one of
///
///     object NAME                  begins an object; its index is the class id of its detections
///     threshold auto | NUMBER      of the object's views, 0 < NUMBER <= 1; without this line auto
///     view FILE [NUMBER]           a reference view, relative to the folder, with a threshold of its own
///     test_view FILE               a view that only measurements use
///
/// or nothing; # begins a comment. Throws DatabaseError.
std::vector<DatabaseObject> read_database(const std::filesystem::path& folder, int side_px, TestViews test_views);

}  // namespace takt::object_detection
