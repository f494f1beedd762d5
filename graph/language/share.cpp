// SPDX-License-Identifier: Apache-2.0
#include "graph/language/share.hpp"

#include <dlfcn.h>

#include <cstdlib>

#include "rt/abi.hpp"

namespace takt::graph {
namespace {

namespace fs = std::filesystem;

/// share/takt in a folder above `file`; empty if none has it.
fs::path share_above(const fs::path& file) {
  std::error_code ignored;
  for (fs::path folder = fs::weakly_canonical(file, ignored).parent_path(); folder.has_relative_path();
       folder = folder.parent_path())
    if (const fs::path share = folder / "share/takt"; fs::is_directory(share, ignored))
      return fs::canonical(share, ignored);
  return {};
}

fs::path find_share() {
  Dl_info core{};
  if (dladdr(reinterpret_cast<const void*>(&version), &core) != 0)
    if (fs::path share = share_above(core.dli_fname); !share.empty()) return share;
  std::error_code unreadable;
  return share_above(fs::read_symlink("/proc/self/exe", unreadable));
}

fs::path assets() { return share_folder() / "graph"; }

}  // namespace

fs::path share_folder() {
  static const fs::path found = find_share();
  const char* home = std::getenv("TAKT_HOME");
  std::error_code ignored;
  return home == nullptr || *home == '\0' ? found : fs::absolute(home, ignored).lexically_normal();
}

std::string default_asset(const ParamBase& param) {
  const std::string name = param.value_text();
  std::error_code ignored;
  const fs::path shared = assets() / name;
  return name.empty() || share_folder().empty() || !fs::exists(shared, ignored) ? name : shared.string();
}

std::string recorded_text(const ParamBase& param) {
  std::string text = param.value_text();
  if (param.unit() != kPath || share_folder().empty() || !fs::path(text).is_absolute()) return text;
  const fs::path within = fs::path(text).lexically_relative(assets());
  return within.empty() || *within.begin() == ".." ? text : within.string();
}

}  // namespace takt::graph
