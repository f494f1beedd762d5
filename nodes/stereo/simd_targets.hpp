// SPDX-License-Identifier: Apache-2.0
// Internal: which SIMD targets the kernels are built for. Include before Highway.
#pragma once
// SSSE3 and AVX3_DL give these loops nothing over their neighbours; vectors of unknown length have no register arrays.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
// Machines without any of the rest get the emulated 128-bit vectors. Highway avoids them on GCC before 12.3 because of
// a miscompiled 16-bit multiply-high, which nothing here uses; the property test runs this target too.
#define HWY_BROKEN_EMU128 0
