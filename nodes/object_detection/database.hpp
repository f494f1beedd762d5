// SPDX-License-Identifier: Apache-2.0
// The object database: a folder with a list, objects.txt, and the reference views it names.
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
enum class Stage : uint8_t { colour, orientation, cooccurrence, layout };
constexpr size_t kStages = 4, kHistogramStages = 3;
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

/// What is known of an object where it looks like this, such as closed = true of a bottle.
struct Attribute {
  std::string name, value;
  bool operator==(const Attribute&) const = default;
};

/// An object as it looks with these attribute values. Entries of one name are the same object.
struct DatabaseObject {
  std::string name;
  std::vector<Attribute> attributes;  ///< by name
  Thresholds thresholds;
  std::vector<ReferenceView> views;
  std::vector<ReferenceView> test_views;  ///< for measurements, never compared with

  /// As in the list: "bottle closed=true".
  std::string label() const;
};

/// Surroundings without any of the objects, 8-bit BGR.
struct Photograph {
  std::filesystem::path file;
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;

  ImageView<const uint8_t> view() const { return {pixels.data(), width, height, 3}; }
};

/// What cannot be used: "FILE:LINE: what is wrong; what is valid".
struct DatabaseError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class TestViews : uint8_t { skip, read };

/// Reads the list, in the folder, and the views it names, each `side_px` x `side_px`. A line holds one of
///
///     object NAME [ATTRIBUTE=VALUE ...]   begins an entry; its index is the class id of its detections, which so
///                                  carry the attributes. Entries of one name have the same attributes, other values
///     threshold T [T [T [T]]]      of the object's views in the stages colour, orientation, co-occurrence, layout: a
///                                  number above 0, at most 1, or auto, as without
///     view FILE [T [T [T]]]        a reference view, relative to the folder; with thresholds of its own in the first
///                                  three stages, auto: the object's
///     test_view FILE               a view that only measurements use
///     background FILE              a photograph without any of the objects, of any size: read_backgrounds()
///
/// or nothing; # begins a comment. Throws DatabaseError.
std::vector<DatabaseObject> read_database(const std::filesystem::path& folder, int side_px, TestViews test_views,
                                          const std::string& list = "objects.txt");

/// The photographs that the list names. Throws DatabaseError.
std::vector<Photograph> read_backgrounds(const std::filesystem::path& folder, const std::string& list = "objects.txt");
/// An image file as one. Throws DatabaseError if it is none.
Photograph read_photograph(const std::filesystem::path& file);

/// Class ids that stay while a database changes: an entry keeps that of the first list that had its label, whatever its
/// place, and what is new is counted on.
class ClassIds {
 public:
  /// Of the first list: the places in it.
  explicit ClassIds(const std::vector<DatabaseObject>& first) { of(first); }
  /// Of each entry.
  std::vector<float> of(const std::vector<DatabaseObject>& database);

 private:
  std::vector<std::string> labels_;
};

/// Names and attributes of the entries alone, for who needs to know what class ids mean: no image is read. Throws
/// DatabaseError.
std::vector<DatabaseObject> read_classes(const std::filesystem::path& folder, const std::string& list = "objects.txt");

}  // namespace takt::object_detection
