// SPDX-License-Identifier: Apache-2.0
#pragma once

/// How CUDA's runtime is played where there is no card (shim.cpp). Exported by a plug-in that is built with it.
struct CudaShim {
  int fail_at = 0;  ///< number of the call that fails, from 1; 0: none. Calls that give something back do not count
  int calls = 0;
  int live = 0;  ///< blocks of memory, registrations, streams and graphs that were not given back
};
