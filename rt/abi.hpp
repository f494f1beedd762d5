// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/abi.hpp>: core, stable.
// Which build this is, and which plug-ins fit it.
//
//   std::printf("takt %s (%s)\n", takt::version().number, takt::version().commit);
//   if (takt::version().abi != takt::kAbi) refuse(takt::abi_difference(takt::kAbi, takt::version().abi));
//
// A plug-in carries its own kAbi. The host compares it with its own before it calls anything of the plug-in.
#pragma once
#include <string>
#include <string_view>

#include "rt/abi_declarations.hpp"

#define TAKT_ABI_TEXT_(x) #x
#define TAKT_ABI_TEXT(x) TAKT_ABI_TEXT_(x)

#if defined(__clang__)
#define TAKT_ABI_COMPILER "clang " TAKT_ABI_TEXT(__clang_major__)
#else
#define TAKT_ABI_COMPILER "gcc " TAKT_ABI_TEXT(__GNUC__)
#endif

#if defined(NDEBUG)
#define TAKT_ABI_NDEBUG "set"
#else
#define TAKT_ABI_NDEBUG "not set"
#endif

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TAKT_ABI_SANITIZER "address"
#elif __has_feature(thread_sanitizer)
#define TAKT_ABI_SANITIZER "thread"
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define TAKT_ABI_SANITIZER "address"
#elif defined(__SANITIZE_THREAD__)
#define TAKT_ABI_SANITIZER "thread"
#endif
#if !defined(TAKT_ABI_SANITIZER)
#define TAKT_ABI_SANITIZER "none"
#endif

// Eigen aligns its types by the widest vectors that the compiler may use.
#if defined(__AVX512F__)
#define TAKT_ABI_VECTORS "AVX-512"
#define TAKT_ABI_ALIGNMENT 64
#elif defined(__AVX__)
#define TAKT_ABI_VECTORS "AVX"
#define TAKT_ABI_ALIGNMENT 32
#else
#define TAKT_ABI_VECTORS "no AVX"
#define TAKT_ABI_ALIGNMENT 16
#endif
#if defined(EIGEN_MAX_ALIGN_BYTES)
#undef TAKT_ABI_ALIGNMENT
#define TAKT_ABI_ALIGNMENT EIGEN_MAX_ALIGN_BYTES
#endif

namespace takt {

/// What two binaries must have in common to pass C++ objects to each other: `property=value` pairs, separated by `;`.
/// Each source file that reads it gets its own, by its own compiler flags: a plug-in never sees the host's.
constexpr const char kAbi[] =
    "declarations=" TAKT_ABI_DECLARATIONS ";compiler=" TAKT_ABI_COMPILER
    ";C++11 ABI=" TAKT_ABI_TEXT(_GLIBCXX_USE_CXX11_ABI) ";NDEBUG=" TAKT_ABI_NDEBUG ";sanitizer=" TAKT_ABI_SANITIZER
                                                        ";vectors=" TAKT_ABI_VECTORS
                                                        ";EIGEN_MAX_ALIGN_BYTES=" TAKT_ABI_TEXT(TAKT_ABI_ALIGNMENT);

/// The build of libtakt_core.
struct Version {
  const char* number;    ///< as in CHANGELOG.md: "0.2.0"
  const char* commit;    ///< `git describe --always --dirty`; "unknown" outside a checkout
  std::string_view abi;  ///< its kAbi
};

/// The build of the libtakt_core in use. Any thread.
Version version();

/// What differs between two values of kAbi, for an error message; empty if nothing does. Example:
/// "compiler is clang 14, here gcc 12; NDEBUG is not set, here set". A value that is no kAbi differs as a whole.
std::string abi_difference(std::string_view theirs, std::string_view ours);

}  // namespace takt
