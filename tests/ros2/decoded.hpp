// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace takt::test {

/// A message of ROS 2 as JSON, decoded by Fast CDR from the order of the members in its .msg file alone. Of long arrays
/// the size and some elements. Throws what Fast CDR throws, std::runtime_error for a type that it does not know, or for
/// bytes behind the message.
std::string decoded(const std::string& dds_type, const std::vector<uint8_t>& cdr);

}  // namespace takt::test
