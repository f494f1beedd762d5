// SPDX-License-Identifier: Apache-2.0
#include "graph/machine_file/apply.hpp"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "hal/settings/json.hpp"
#include "rt/file/output_file.hpp"

namespace takt::graph {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

fs::path below(const fs::path& root, const std::string& path) { return root / fs::path(path).relative_path(); }

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return std::move(text).str();
}

/// What is at a place: {} for nothing, {"link": ...} or {"content": ...}.
json state_of(const fs::path& place) {
  const fs::file_status status = fs::symlink_status(place);
  if (fs::is_symlink(status)) return {{"link", fs::read_symlink(place).string()}};
  if (fs::exists(status)) return {{"content", content(place)}};
  return json::object();
}

/// Makes it so. Throws what the system says.
void put(const fs::path& place, const json& state) {
  if (state.empty()) {
    fs::remove(place);
    return;
  }
  fs::create_directories(place.parent_path());
  if (state.contains("link")) {
    fs::remove(place);
    fs::create_symlink(state["link"].get<std::string>(), place);
    return;
  }
  require_written(write_file(place, state["content"].get<std::string>()));
}

fs::path list_file(const fs::path& root) { return state_folder(root) / "applied.json"; }

/// What `work` throws as an error.
template <class Work>
tl::expected<Applied, std::string> guarded(const Work& work) {
  try {
    return work();
  } catch (const fs::filesystem_error& error) {
    return tl::unexpected(fmt::format("{}: {}", error.path1().string(), error.code().message()));
  } catch (const OutputError& error) {
    return tl::unexpected(std::string(error.what()));
  } catch (const json::exception&) {
    return tl::unexpected(std::string("the list of what was applied is damaged"));
  }
}

Applied undo(const fs::path& root) {
  Applied done;
  const fs::path list = list_file(root);
  if (!fs::exists(list)) return done;
  for (const json& entry : json::parse(content(list))) {
    const auto path = entry.at("path").get<std::string>();
    const fs::path place = below(root, path);
    const json now = state_of(place);
    if (now == entry.at("before")) continue;
    if (now != entry.at("written")) {
      done.kept.push_back(path);
      continue;
    }
    put(place, entry.at("before"));
    (entry.at("before").empty() ? done.removed : done.restored).push_back(path);
  }
  fs::remove(list);
  return done;
}

}  // namespace

fs::path state_folder(const fs::path& root) { return root / "var/lib/takt/machine"; }

tl::expected<Applied, std::string> undo_files(const fs::path& root) {
  return guarded([&] { return undo(root); });
}

tl::expected<Applied, std::string> apply_files(const std::vector<SystemFile>& files, const fs::path& root) {
  return guarded([&] {
    Applied done = undo(root);
    json list = json::array();
    for (const SystemFile& file : files)
      list.push_back({{"path", file.path},
                      {"before", state_of(below(root, file.path))},
                      {"written", file.link.empty() ? json{{"content", file.content}} : json{{"link", file.link}}}});
    fs::create_directories(state_folder(root));
    require_written(write_file(list_file(root), list.dump(1) + "\n"));
    for (const json& entry : list) {
      put(below(root, entry["path"].get<std::string>()), entry["written"]);
      done.written.push_back(entry["path"].get<std::string>());
    }
    return done;
  });
}

}  // namespace takt::graph
