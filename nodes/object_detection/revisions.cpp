// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/revisions.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "rt/xxhash.hpp"

namespace takt::object_detection {
namespace {

namespace fs = std::filesystem;

/// The list, all views and backgrounds, relative to the folder, each once.
std::vector<fs::path> files_of(const fs::path& folder, int side_px) {
  std::vector<fs::path> files{"objects.txt"};
  for (const DatabaseObject& object : read_database(folder, side_px, TestViews::read))
    for (const auto* views : {&object.views, &object.test_views})
      for (const ReferenceView& view : *views) files.push_back(view.file.lexically_relative(folder));
  for (const Photograph& photograph : read_backgrounds(folder))
    files.push_back(photograph.file.lexically_relative(folder));
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

/// Of names and content.
std::string name_of(const fs::path& folder, const std::vector<fs::path>& files) {
  std::string all;
  for (const fs::path& file : files) {
    std::ifstream in(folder / file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    all += file.string() + '\0' + std::to_string(bytes.size()) + '\0' + bytes;
  }
  char name[17];
  std::snprintf(name, sizeof name, "%016llx", static_cast<unsigned long long>(XXH3_64bits(all.data(), all.size())));
  return name;
}

fs::path revisions_of(const fs::path& folder) {
  const fs::path plain = folder.lexically_normal();
  return (plain.has_filename() ? plain : plain.parent_path()).string() + ".revisions";
}

}  // namespace

std::string publish_revision(const fs::path& folder, int side_px) {
  const std::vector<fs::path> files = files_of(folder, side_px);
  const std::string name = name_of(folder, files);
  const fs::path revision = revisions_of(folder) / name;
  if (fs::exists(revision)) return name;
  const fs::path unfinished = revisions_of(folder) / ("." + std::to_string(getpid()));  // replay: no job writes it
  try {
    for (const fs::path& file : files) {
      fs::create_directories((unfinished / file).parent_path());
      fs::copy_file(folder / file, unfinished / file, fs::copy_options::overwrite_existing);
    }
    if (name_of(unfinished, files) != name) throw DatabaseError(folder.string() + " changed while it was copied");
    fs::rename(unfinished, revision);
  } catch (const fs::filesystem_error& error) {
    std::error_code ignored;
    fs::remove_all(unfinished, ignored);
    if (fs::exists(revision)) return name;  // somebody else made the same
    throw DatabaseError(error.what());
  }
  return name;
}

fs::path revision_folder(const fs::path& folder, const std::string& name) { return revisions_of(folder) / name; }

std::vector<DatabaseObject> read_revision(const fs::path& folder, const std::string& name, int side_px) {
  const fs::path revision = revision_folder(folder, name);
  if (name.empty() || name.find('/') != std::string::npos || !fs::is_directory(revision)) {
    std::string there;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(revisions_of(folder), none))
      if (entry.path().filename().string()[0] != '.') there += " " + entry.path().filename().string();
    throw DatabaseError("revision `" + name + "` of " + folder.string() + " is not there; valid are" +
                        (there.empty() ? " none: write one with `takt objects publish`" : there));
  }
  if (name_of(revision, files_of(revision, side_px)) != name)
    throw DatabaseError(revision.string() + " was changed: its content is not what its name says");
  return read_database(revision, side_px, TestViews::skip);
}

}  // namespace takt::object_detection
