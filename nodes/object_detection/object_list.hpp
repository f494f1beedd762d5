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
  /// made if there is none. Its image will be NAME/0.png, 1.png ..., the first that is free.
  void add(const std::string& label, ReferenceView view, bool test_view);
  /// Of the entry, in the place of those it has.
  void set_thresholds(const std::string& label, const Thresholds& thresholds);
  /// Writes the new views, reads the changed list as the node would, and only then puts it in the place of the old one,
  /// in one step: nobody ever sees half of it. If anything fails, all is as it was.
  void save(int side_px);

 private:
  struct Block {
    size_t first, end;  ///< lines: `object ...`, and behind the entry's last line that is not empty
  };
  void write(int side_px);
  /// Of the entry; first == end == number of lines if there is none.
  Block find(const std::string& label) const;

  std::filesystem::path folder_;
  std::vector<std::string> lines_;
  std::vector<ReferenceView> added_;  ///< with the files they are to have
};

}  // namespace takt::object_detection
