// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

namespace takt::web {

/// A file of the page, as page/ builds it ahead and this program carries it.
struct PageFile {
  std::string_view path;  ///< "/", "/page.js"
  const char* type;
  std::string_view bytes;
};

/// Null: there is none under that path.
const PageFile* page_file(std::string_view path);

}  // namespace takt::web
