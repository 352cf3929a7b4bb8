#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"

struct ZSTD_CCtx_s;

namespace axlecast {

// A compressed log, NAME.lcm.zst: Zstandard frames (RFC 8878), each with at most kFrameBytes of the log, their size and a checksum.
// Frames are cut at any byte of the log. The last frame is a skippable one with CompressedLogSummary. The program `zstd` reads these
// files, and a log that it has compressed can be read here.

inline constexpr std::size_t kFrameBytes = 8U
                                           << 20;  // bounds the memory of the compression, and the loss by damage

// Ends a file that the recorder has compressed, so that its sizes and times are known without decompression.
struct CompressedLogSummary {
  std::uint64_t bytes = 0;       // of the log
  std::int64_t first_utime = 0;  // LogSpan of the log
  std::int64_t last_utime = 0;
  bool operator==(const CompressedLogSummary&) const = default;
};

// Compresses a log piece by piece, at level 3.
class LogCompressor {
 public:
  // Returns the frame of the next piece: 1 to kFrameBytes bytes. The result is valid until the next call. Fails if memory is missing.
  [[nodiscard]] Result<Bytes> Compress(Bytes piece);

 private:
  struct Free {
    void operator()(ZSTD_CCtx_s* context) const;
  };
  std::unique_ptr<ZSTD_CCtx_s, Free> context_;
  std::vector<std::uint8_t> frame_;
};

[[nodiscard]] std::vector<std::uint8_t> EncodeSummary(const CompressedLogSummary& summary);
// Returns the summary at the end of the file; nothing if the file does not end with one.
[[nodiscard]] std::optional<CompressedLogSummary> FindSummary(Bytes file);

// Returns true if the file begins like a Zstandard frame, skippable or not. A log does not.
[[nodiscard]] bool IsCompressed(Bytes file);

// A region of a compressed file that could not be decompressed.
struct CompressedDamage {
  std::size_t offset = 0;  // in the compressed file
  std::size_t size = 0;
  bool operator==(const CompressedDamage&) const = default;
};

// Decompresses a file of any number of frames, and calls `take` with each piece of its content, in order, until `take` returns
// false. `position`: how much of the file was read. Continues behind a damaged region at the next frame. What a damaged frame
// contains up to the damage is passed to `take`; if only its checksum is wrong, all of it. Uses at most 128 MiB, as the
// program `zstd` does by default; a frame that needs more counts as damaged.
[[nodiscard]] std::vector<CompressedDamage> Decompress(
    Bytes file, const std::function<bool(Bytes piece, std::size_t position)>& take);

}  // namespace axlecast
