// SPDX-License-Identifier: Apache-2.0
// Internal: which SIMD targets the kernels are built for. Include before Highway.
#pragma once
// SSSE3 and AVX3_DL give these loops nothing over their neighbours; vectors of unknown length have no register arrays.
#define TAKT_STEREO_UNUSED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_DISABLED_TARGETS  // which a build for ARM sets for all
#ifdef TAKT_STEREO_COUNTS_ONES  // which AVX3_DL has an instruction for
#define HWY_WANT_AVX3_DL
#define HWY_DISABLED_TARGETS TAKT_STEREO_UNUSED_TARGETS
#else
#define HWY_DISABLED_TARGETS (TAKT_STEREO_UNUSED_TARGETS | HWY_AVX3_DL)
#endif
// Machines without any of the rest get the emulated 128-bit vectors. Highway avoids them on GCC before 12.3 because of
// a miscompiled 16-bit multiply-high, which nothing here uses; the property test runs this target too.
#define HWY_BROKEN_EMU128 0
