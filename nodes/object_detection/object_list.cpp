// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/object_list.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <utility>

#include "nodes/object_detection/cut_out.hpp"
#include "rt/file/input_file.hpp"

namespace takt::object_detection {
namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream text(line.substr(0, line.find('#')));
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  return words;
}

/// The words behind `object`, attributes by name.
std::string label_of(std::vector<std::string> words) {
  std::sort(words.begin() + std::min<ptrdiff_t>(2, std::ssize(words)), words.end());
  std::string label;
  for (size_t i = 1; i < words.size(); ++i) label += (i > 1 ? " " : "") + words[i];
  return label;
}

}  // namespace

ObjectList::ObjectList(const std::filesystem::path& folder) : folder_(folder) {
  if (std::filesystem::exists(folder / "objects.txt")) require_readable<DatabaseError>(folder / "objects.txt");
  std::ifstream in(folder / "objects.txt");
  for (std::string line; std::getline(in, line);) lines_.push_back(line);
}

ObjectList::Block ObjectList::find(const std::string& label) const {
  for (size_t first = 0; first < lines_.size(); ++first) {
    const auto words = words_of(lines_[first]);
    if (words.empty() || words[0] != "object" || label_of(words) != label) continue;
    Block block{first, first + 1};
    for (size_t line = first + 1; line < lines_.size(); ++line) {
      const auto next = words_of(lines_[line]);
      if (next.empty()) continue;
      if (next[0] == "object") break;
      block.end = line + 1;
    }
    return block;
  }
  return {lines_.size(), lines_.size()};
}

void ObjectList::add(const std::string& label, ReferenceView view, bool test_view) {
  Block block = find(label);
  if (block.first == block.end) {
    if (!lines_.empty()) lines_.emplace_back();
    lines_.push_back("object " + label);
    block = find(label);
  }
  std::string stem = label;
  std::replace(stem.begin(), stem.end(), ' ', '_');
  if (stem.find('/') != std::string::npos)
    throw DatabaseError("object `" + label + "`: a name holds no `/`; views are kept under it");
  int number = 0;
  const auto file = [&] { return stem + "/" + std::to_string(number) + ".png"; };
  const auto taken = [&](const ReferenceView& other) { return other.file == folder_ / file(); };
  while (std::filesystem::exists(folder_ / file()) || std::any_of(added_.begin(), added_.end(), taken)) ++number;
  view.file = folder_ / file();
  added_.push_back(std::move(view));
  lines_.insert(lines_.begin() + static_cast<ptrdiff_t>(block.end), (test_view ? "test_view " : "view ") + file());
}

void ObjectList::set_thresholds(const std::string& label, const Thresholds& thresholds) {
  const Block block = find(label);
  if (block.first == block.end)
    throw DatabaseError((folder_ / "objects.txt").string() + " has no object `" + label + "`");
  std::ostringstream text;
  text << "threshold";
  size_t given = thresholds.size();
  while (given > 1 && !thresholds[given - 1]) --given;
  for (size_t s = 0; s < given; ++s) {
    text << ' ';
    if (thresholds[s]) text << *thresholds[s];
    else text << "auto";
  }
  for (size_t line = block.first + 1; line < block.end; ++line) {
    const auto words = words_of(lines_[line]);
    if (words.empty() || words[0] != "threshold") continue;
    lines_[line] = text.str();
    return;
  }
  lines_.insert(lines_.begin() + static_cast<ptrdiff_t>(block.first) + 1, text.str());
}

void ObjectList::save(int side_px) {
  try {
    write(side_px);
    added_.clear();
  } catch (...) {
    std::error_code ignored;
    for (const ReferenceView& view : added_) {
      std::filesystem::remove(view.file, ignored);
      std::filesystem::remove(view.file.parent_path(), ignored);  // only if nothing else is in it
    }
    throw;
  }
}

void ObjectList::write(int side_px) {
  const std::string name = "objects.txt." + std::to_string(getpid());  // replay: no job writes it
  for (const ReferenceView& view : added_) {
    std::filesystem::create_directories(view.file.parent_path());
    write_view(view, view.file);
  }
  std::ofstream out(folder_ / name);
  for (const std::string& line : lines_) out << line << '\n';
  out.close();
  try {
    if (!out) throw DatabaseError((folder_ / name).string() + " cannot be written");
    read_database(folder_, side_px, TestViews::read, name);
  } catch (const DatabaseError&) {
    std::filesystem::remove(folder_ / name);
    throw;
  }
  std::filesystem::rename(folder_ / name, folder_ / "objects.txt");
}

}  // namespace takt::object_detection
