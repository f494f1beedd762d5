// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace takt::view {

/// Text as it may stand in XML, in HTML and in a quoted attribute of either: & < > " ' escaped, control characters and
/// bytes that are no UTF-8 replaced.
std::string escape(std::string_view text);

/// Bytes as text (RFC 4648).
std::string base64(std::string_view bytes);

}  // namespace takt::view
