// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Calls of operator new in this program so far.
long allocations();
