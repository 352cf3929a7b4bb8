#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

namespace axlecast {

// Opcodes of MCAP's records.
enum class McapOp : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

// The content of one record, put together in order: numbers little-endian, text with its length before it.
class McapRecord {
 public:
  template <std::unsigned_integral Number>
  McapRecord& Add(Number value) {
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      content_ += static_cast<char>(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    return *this;
  }
  McapRecord& Text(std::string_view text) {
    Add(static_cast<std::uint32_t>(text.size()));
    return Raw(text);
  }
  McapRecord& Raw(std::string_view bytes) {
    content_ += bytes;
    return *this;
  }
  [[nodiscard]] const std::string& content() const { return content_; }

  // With its opcode and length.
  [[nodiscard]] std::string As(McapOp op) const {
    McapRecord head;
    head.Add(static_cast<std::uint8_t>(op)).Add(std::uint64_t{content_.size()});
    return head.content_ + content_;
  }

 private:
  std::string content_;
};

}  // namespace axlecast
