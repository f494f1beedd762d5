// SPDX-License-Identifier: Apache-2.0
// The object database: a folder with a list, objects.txt, and the reference views it names (algorithm reference 6.8).
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// The stages of the cascade, in their order.
enum class Stage : uint8_t { colour, orientation, cooccurrence };
constexpr size_t kStages = 3;
/// Per stage the error below which a window passes; none: the object's, and there automatic_threshold.
using Thresholds = std::array<std::optional<double>, kStages>;

/// An object cut out on black: 8-bit BGR, (0, 0, 0) is background.
struct ReferenceView {
  std::filesystem::path file;
  int side_px = 0;
  std::vector<uint8_t> pixels;
  Thresholds thresholds;

  ImageView<const uint8_t> view() const { return {pixels.data(), side_px, side_px, 3}; }
};

struct DatabaseObject {
  std::string name;
  Thresholds thresholds;
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
///     threshold T [T [T]]          of the object's views in the stages colour, orientation, co-occurrence: a number
///                                  above 0, at most 1, or auto, as without
///     view FILE [T [T [T]]]        a reference view, relative to the folder; with thresholds of its own, auto: the
///     object's test_view FILE               a view that only measurements use
///
/// or nothing; # begins a comment. Throws DatabaseError.
std::vector<DatabaseObject> read_database(const std::filesystem::path& folder, int side_px, TestViews test_views);

}  // namespace takt::object_detection
