// SPDX-License-Identifier: Apache-2.0
// Frames of the LMS 400 as public drivers send and read them, and one that a SICK manual prints (anchor_tim781).
#pragma once
#include <string_view>

namespace takt::test {

struct GoldenFrame {
  std::string_view name, text;
  unsigned bytes, checksum;
};

inline constexpr GoldenFrame kLms400Texts[] = {
    {"anchor_tim781", "sRN LMDscandata", 24, 0x05},
    {"login_user2", "sMN SetAccessMode 2 B21ACE26", 37, 0x25},
    {"login_user3", "sMN SetAccessMode 3 F4724744", 37, 0x52},
    {"login_service", "sMN SetAccessMode 4 81BE23AA", 37, 0x2E},
    {"req_dist_rem", "sMN mLRreqdata 20", 26, 0x77},
    {"req_dist", "sMN mLRreqdata 21", 26, 0x76},
    {"req_rem", "sMN mLRreqdata 22", 26, 0x75},
    {"req_dist_4digit", "sMN mLRreqdata 0021", 28, 0x76},
    {"req_1020", "sMN mLRreqdata 1020", 28, 0x76},
    {"stop", "sMN mLRstopdata", 24, 0x2B},
    {"run", "sMN Run", 16, 0x19},
    {"reset", "sMN mDCreset ", 22, 0x6F},
    {"mac", "sRN EImac ", 19, 0x0C},
    {"ident_serial", "sRI 3", 14, 0x7B},
    {"scanconfig_360_025", "sMN mSCsetscanconfig +360.00 +0.25 +55.00 +70.00", 57, 0x5F},
    {"scanconfig_500_050", "sMN mSCsetscanconfig +500.00 +0.50 +55.00 +70.00", 57, 0x5D},
    {"configbyang", "sMN mSCconfigbyang 03 F4724744 +0.1 +0 +55.000000 +70.000000", 69, 0x3B},
    {"filter_mean_par", "sWN FLmean 0 10", 24, 0x76},
    {"filter_range_par", "sWN FLrang +700.000000 +3000.000000", 44, 0x6E},
    {"filter_select", "sWN FLsel +9", 21, 0x08},
    {"extended_ris", "sWN MDblex 1", 21, 0x41},
    {"ack_req", "sMA mLRreqdata", 23, 0x5A},
    {"ans_req_ok", "sAN mLRreqdata 00000000", 32, 0x79},
    {"ack_stop", "sMA mLRstopdata", 24, 0x24},
    {"ans_stop_ok", "sAN mLRstopdata 00000000", 33, 0x07},
    {"ack_scanconfig", "sMA mSCsetscanconfig", 29, 0x55},
    {"ans_scanconfig", "sAN mSCsetscanconfig 00000000 43B40000 3E800000 0000000A", 65, 0x28},
    {"ack_login", "sMA SetAccessMode", 26, 0x1A},
    {"ans_login_ok", "sAN SetAccessMode 1", 28, 0x08},
    {"ans_write", "sWA FLsel", 18, 0x35},
    {"err_sfa", "sFA FF", 15, 0x54},
    {"err_sfa_3", "sFA 0003", 17, 0x57},
};

struct GoldenHex {
  std::string_view name, hex;
};

inline constexpr GoldenHex kLms400Measurements[] = {
    {"m20_small",
     "02020202000000352000010070640800C4090500680101000000FF00BC020AE80314DC051EB80B2800000000000000000000"
     "000000000000003412000053"},
    {"m21_small",
     "020202020000002E2100010070640800C4090400680101000000FF00BC02E803DC05B80B0000000000000000000000000000"
     "020000005F"},
    {"m22_small",
     "020202020000002A2200010070640800C4090400680101000000FF00010203FF000000000000000000000000000003000000"
     "9D"},
};

/// Cut, joined and damaged.
inline constexpr GoldenHex kLms400Streams[] = {
    {"start_sequence",
     "020202020000000E734D41206D4C52726571646174615A020202020000001773414E206D4C52726571646174612030303030"
     "303030307902020202000000352000010070640800C4090500680101000000FF00BC020AE80314DC051EB80B280000000000"
     "0000000000000000000000003412000053"},
    {"scan_between_ack_and_answer",
     "020202020000000E734D41206D4C52726571646174615A02020202000000352000010070640800C4090500680101000000FF"
     "00BC020AE80314DC051EB80B2800000000000000000000000000000000003412000053020202020000001773414E206D4C52"
     "7265716461746120303030303030303079"},
    {"bad_xor_then_good",
     "02020202000000352000010070640800C4090500680101000000FF00BC020AE80314DC051EB80B2800000000000000000000"
     "0000000000000034120000AC02020202000000352000010070640800C4090500680101000000FF00BC020AE80314DC051EB8"
     "0B2800000000000000000000000000000000003412000053"},
    {"stx_run_of_five",
     "0202020202000000352000010070640800C4090500680101000000FF00BC020AE80314DC051EB80B28000000000000000000"
     "00000000000000003412000053"},
    {"truncated_then_good",
     "02020202000000352000010070640800C4090500680101000000FF00BC0202020202000000352000010070640800C4090500"
     "680101000000FF00BC020AE80314DC051EB80B2800000000000000000000000000000000003412000053"},
};

}  // namespace takt::test
