#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"

namespace axlecast {

// Columns of a chunk's body. docs/fleet.md describes the bytes; the database decodes them with axlecast.column_values.
//
// body = version u8, number of columns u8, then each column: id u8, mode u8, width u8, size u32 (bytes behind it), data.
// All integers are big-endian. The number of values of a column is not in the body: a row has it.
inline constexpr std::uint8_t kBodyVersion = 1;
inline constexpr std::size_t kMaxChunkSamples = 256;

// Append only: a database contains them.
enum class ColumnId : std::uint8_t {
  kTime = 1,  // us after t0
  kCounts = 2,
  kFlags = 3,
  kSeq = 4,  // minus seq0. Without this column, sample i has seq0 + i
  kMissed = 5,
  kUncertainty = 6,  // ns
  kMonoOffset = 7,   // mono_ns - utime x 1000
  kRawCounts = 8,
  kRawTurns = 9,
  kSpeed = 10,  // bits of the float32
  kDeviceStatus = 11,
  kTick = 12,
  kReceived = 13,  // us after t0
  kSpeedRest =
      14,  // bits of the double minus bits of the float32 as a double. Without it: 0, as of the columns below
  kAngleRest = 15,  // bits of angle_rad minus bits of the angle that follows from counts and flags
  kValueRest = 16,  // bits of value minus bits of counts x unit_per_count (NaN if not valid)
  kClockId = 17,
  kMachineId = 18,
};

enum class ColumnMode : std::uint8_t {
  kLinear = 0,        // first, last, n residuals: v[i] = first + (last - first) x i / (n - 1), toward zero, + r[i]
  kDelta = 1,         // first, n - 1 residuals: v[i] = v[i-1] + r
  kDeltaOfDelta = 2,  // first, delta, n - 2 residuals: v[1] = first + delta, v[i] = 2 v[i-1] - v[i-2] + r
  kRuns = 3,          // as often as needed: length u16, value i64
};

// Appends a column in its smallest form. `values`: 1 to kMaxChunkSamples.
void AppendColumn(std::vector<std::uint8_t>& body, ColumnId id, std::span<const std::int64_t> values);

// A column within a body, checked for its length only.
struct ColumnView {
  std::uint8_t id = 0;
  std::uint8_t mode = 0;
  std::uint8_t width = 0;
  Bytes data;
};

// Splits a body into its columns. Columns of unknown ids are returned too. Fails on another version, an id that occurs twice, a
// column that is cut, and on bytes behind the last column.
[[nodiscard]] Result<std::vector<ColumnView>> SplitBody(Bytes body);

// Decodes the `n` values of a column (1 to kMaxChunkSamples). Fails if the data does not contain exactly n values.
[[nodiscard]] Result<std::vector<std::int64_t>> DecodeColumn(const ColumnView& column, std::size_t n);

// The version byte and the number of columns that follow.
void BeginBody(std::vector<std::uint8_t>& body, std::size_t columns);

}  // namespace axlecast
