# SPDX-License-Identifier: Apache-2.0
"""Builds, tries, writes and updates machines that boot into a Takt graph; `takt image` is its command line."""
