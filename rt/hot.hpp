// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Of functions between a release and the node's code: they lie next to one another in the program. A job comes to cold
/// caches, and each page of code that it enters costs it a miss.
#define TAKT_HOT [[gnu::hot]]
