// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace takt::dds {

/// Bytes that each socket asks for to receive in; as much of it as net.core.rmem_max allows.
inline constexpr int kSocketBuffer = 4 << 20;

}  // namespace takt::dds
