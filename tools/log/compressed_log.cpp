#include "tools/log/compressed_log.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <string>

#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr int kLevel = 3;
constexpr std::size_t kMagic = 4;  // bytes
constexpr std::uint32_t kSummaryFrame = ZSTD_MAGIC_SKIPPABLE_START + 10;
constexpr std::string_view kSummaryName = "axlecast";
constexpr std::size_t kSummaryContent = 32;  // bytes: name, and three numbers
constexpr std::size_t kSummaryBytes = 8 + kSummaryContent;

std::uint32_t ReadMagic(Bytes bytes) {  // little-endian, as all of a Zstandard frame
  return std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8U | std::uint32_t{bytes[2]} << 16U |
         std::uint32_t{bytes[3]} << 24U;
}

bool BeginsFrame(Bytes bytes) {
  if (bytes.size() < kMagic) return false;
  const std::uint32_t magic = ReadMagic(bytes);
  return magic == ZSTD_MAGICNUMBER || (magic & ZSTD_MAGIC_SKIPPABLE_MASK) == ZSTD_MAGIC_SKIPPABLE_START;
}

// Returns the offset of the next frame of content at or after `from`; the end of the file if no frame follows. Skippable frames are
// not looked for: their magic is less unlikely within damaged bytes.
std::size_t FindFrame(Bytes file, std::size_t from) {
  constexpr std::array<std::uint8_t, kMagic> kBytes = {0x28, 0xB5, 0x2F, 0xFD};
  if (from >= file.size()) return file.size();
  const auto found =
      std::search(file.begin() + static_cast<std::ptrdiff_t>(from), file.end(), kBytes.begin(), kBytes.end());
  return static_cast<std::size_t>(found - file.begin());
}

struct FreeDecoder {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

constexpr std::size_t kFrameStart = 5;  // bytes: the magic, and the byte that states the size of the header

class Decoder {
 public:
  using Take = std::function<bool(Bytes piece, std::size_t position)>;

  Decoder(Bytes file, const Take& take) : file_(file), take_(take), content_(ZSTD_DStreamOutSize()) {}

  // Reads the frame at `begin`. Returns the offset of its end; nothing if it is damaged or incomplete.
  std::optional<std::size_t> ReadFrame(std::size_t begin) {
    if (context_ == nullptr) context_.reset(ZSTD_createDCtx());
    if (context_ == nullptr) return std::nullopt;
    ZSTD_DCtx_reset(context_.get(), ZSTD_reset_session_only);
    ZSTD_inBuffer in{file_.data(), begin, begin};
    std::size_t left = kFrameStart;
    while (!stopped_) {
      ZSTD_outBuffer out{content_.data(), content_.size(), 0};
      const std::size_t before = in.pos;
      // No more than the decoder asks for, which is up to the end of a block: with an error, it withholds everything that the call has decoded.
      in.size = std::min(file_.size(), std::max(in.size, in.pos + left));
      left = ZSTD_decompressStream(context_.get(), &out, &in);
      if (out.pos > 0) stopped_ = !take_(Bytes(content_.data(), out.pos), in.pos);
      if (ZSTD_isError(left) != 0) return std::nullopt;
      if (left == 0) return in.pos;
      if (out.pos == 0 && in.pos == before) return std::nullopt;  // the file ends within the frame
    }
    return in.pos;
  }
  [[nodiscard]] bool stopped() const { return stopped_; }

 private:
  Bytes file_;
  const Take& take_;
  std::unique_ptr<ZSTD_DCtx, FreeDecoder> context_;
  std::vector<std::uint8_t> content_;
  bool stopped_ = false;
};

}  // namespace

void LogCompressor::Free::operator()(ZSTD_CCtx_s* context) const { ZSTD_freeCCtx(context); }

Result<Bytes> LogCompressor::Compress(Bytes piece) {
  if (context_ == nullptr) {
    context_.reset(ZSTD_createCCtx());
    if (context_ == nullptr) return Failure("not enough memory to compress");
    ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, kLevel);
    ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_checksumFlag, 1);
  }
  frame_.resize(ZSTD_compressBound(kFrameBytes));
  const std::size_t size = ZSTD_compress2(context_.get(), frame_.data(), frame_.size(), piece.data(), piece.size());
  if (ZSTD_isError(size) != 0) return Failure(std::string("compression failed: ") + ZSTD_getErrorName(size));
  return Bytes(frame_.data(), size);
}

std::vector<std::uint8_t> EncodeSummary(const CompressedLogSummary& summary) {
  std::vector<std::uint8_t> frame;
  for (const std::uint32_t value : {kSummaryFrame, static_cast<std::uint32_t>(kSummaryContent)}) {
    for (unsigned shift = 0; shift < 32; shift += 8) frame.push_back(static_cast<std::uint8_t>(value >> shift));
  }
  frame.insert(frame.end(), kSummaryName.begin(), kSummaryName.end());
  AppendBigEndian(frame, summary.bytes);
  AppendBigEndian(frame, static_cast<std::uint64_t>(summary.first_utime));
  AppendBigEndian(frame, static_cast<std::uint64_t>(summary.last_utime));
  return frame;
}

std::optional<CompressedLogSummary> FindSummary(Bytes file) {
  if (file.size() < kSummaryBytes) return std::nullopt;
  const Bytes frame = file.last(kSummaryBytes);
  const CompressedLogSummary summary{
      .bytes = ReadBigEndian<std::uint64_t>(frame, 16),
      .first_utime = static_cast<std::int64_t>(ReadBigEndian<std::uint64_t>(frame, 24)),
      .last_utime = static_cast<std::int64_t>(ReadBigEndian<std::uint64_t>(frame, 32))};
  return std::ranges::equal(EncodeSummary(summary), frame) ? std::optional(summary) : std::nullopt;
}

bool IsCompressed(Bytes file) { return BeginsFrame(file); }

std::vector<CompressedDamage> Decompress(Bytes file,
                                         const std::function<bool(Bytes piece, std::size_t position)>& take) {
  std::vector<CompressedDamage> damage;
  Decoder decoder(file, take);
  std::size_t position = 0;
  while (position < file.size() && !decoder.stopped()) {
    if (BeginsFrame(file.subspan(position))) {
      if (const auto end = decoder.ReadFrame(position)) {
        position = *end;
        continue;
      }
    }
    const std::size_t next = FindFrame(file, position + 1);
    damage.push_back({position, next - position});
    position = next;
  }
  return damage;
}

}  // namespace axlecast
