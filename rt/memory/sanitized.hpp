// SPDX-License-Identifier: Apache-2.0
// Whether this build runs under a sanitizer, which slows it down many times and has a malloc of its own.
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define TAKT_SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TAKT_SANITIZED 1
#endif

namespace takt {
/// By this factor longer may this build take than others before something counts as hung.
#if defined(TAKT_SANITIZED)
inline constexpr int kSlowdown = 20;
#else
inline constexpr int kSlowdown = 1;
#endif
}  // namespace takt
