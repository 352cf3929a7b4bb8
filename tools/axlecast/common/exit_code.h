#pragma once

namespace axlecast {

// Exit codes of every command (docs/cli.md).
inline constexpr int kExitDone = 0;  // done, and verified
inline constexpr int kExitBad = 1;   // an input is bad, or the result is not good
inline constexpr int kExitUsage = 2;
inline constexpr int kExitRejected = 3;  // rejected, expired or cancelled: nothing was done
inline constexpr int kExitFailed = 4;
inline constexpr int kExitIndeterminate = 5;
inline constexpr int kExitNoAnswer = 6;
inline constexpr int kExitUnverifiable = 7;  // done, but the device allows no read-back

// record, replay, log, redecode and mqtt: done, but data is missing, damaged or different.
inline constexpr int kExitLosses = 3;

}  // namespace axlecast
