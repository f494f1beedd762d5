// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/photographs.hpp"

#include <cstdio>
#include <map>

#include "nodes/object_detection/cut_out.hpp"

namespace takt::object_detection {

std::vector<DatabaseObject> read_turntable(const std::filesystem::path& folder, int side_px) {
  std::map<std::pair<int, int>, std::filesystem::path> files;  // by number and angle
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    int number = 0, angle = 0;
    if (std::sscanf(entry.path().filename().c_str(), "obj%d__%d.png", &number, &angle) == 2)
      files[{number, angle}] = entry.path();
  }
  if (files.empty()) throw DatabaseError(folder.string() + " holds no photograph objNUMBER__ANGLE.png");
  std::vector<DatabaseObject> objects;
  for (const auto& [key, file] : files) {
    const std::string name = "obj" + std::to_string(key.first);
    if (objects.empty() || objects.back().name != name) objects.emplace_back().name = name;
    (key.second % 60 == 0 ? objects.back().views : objects.back().test_views).push_back(cut_out(file, side_px));
  }
  for (const DatabaseObject& object : objects)
    if (object.views.empty() || object.test_views.empty())
      throw DatabaseError(folder.string() + ": of " + object.name +
                          " there must be views at angles that 60 divides, "
                          "to learn, and at others");
  return objects;
}

}  // namespace takt::object_detection
