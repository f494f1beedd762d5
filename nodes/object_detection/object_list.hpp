// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/object_detection/database.hpp"

namespace takt::object_detection {

/// A database's objects.txt as text, for changes: comments and what is not changed stay. Errors are DatabaseError.
class ObjectList {
 public:
  /// Of a folder, which need not have one yet.
  explicit ObjectList(const std::filesystem::path& folder);

  /// Adds a reference or test view to the entry with this label ("bottle closed=true", attributes by name), which is
  /// made if there is none: writes the image as NAME/0.png, 1.png ... under the first name that is free.
  void add(const std::string& label, const ReferenceView& view, bool test_view);
  /// Of the entry, in the place of those it has.
  void set_thresholds(const std::string& label, const Thresholds& thresholds);
  /// Reads the changed list as the node would and only then puts it in the place of the old one, in one step: nobody
  /// ever sees half of it. Otherwise the old list stays, and so it does without save().
  void save(int side_px);

 private:
  struct Block {
    size_t first, end;  ///< lines: `object ...`, and behind the entry's last line that is not empty
  };
  /// Of the entry; first == end == number of lines if there is none.
  Block find(const std::string& label) const;

  std::filesystem::path folder_;
  std::vector<std::string> lines_;
};

}  // namespace takt::object_detection
