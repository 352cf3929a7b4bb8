#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// Reads a few blocks one after the other and keeps their data. Not for passwords.
class BlockReader {
 public:
  enum class Progress : std::uint8_t { kGoing, kDone, kFailed };

  BlockReader(const Requests& requests, std::vector<Block> blocks);

  [[nodiscard]] Exchange Next() const { return requests_->Read(parts_[done_].block); }
  [[nodiscard]] Progress OnAnswer(const Answer& answer);
  // After kFailed: why, and the REASON_* of it.
  [[nodiscard]] const std::string& cause() const { return cause_; }
  [[nodiscard]] std::int32_t reason() const { return reason_; }
  void Restart();

  // Of a block that was read.
  [[nodiscard]] Bytes Data(const Block& block) const;
  [[nodiscard]] std::uint16_t Register(const Block& block, std::size_t index) const;
  [[nodiscard]] bool Bit(const Block& block) const { return (Data(block)[0] & 1U) != 0; }

 private:
  static constexpr std::size_t kMaxBytes = 40;
  struct Part {
    Block block;
    InlineBytes<kMaxBytes> data;
  };

  const Requests* requests_;
  std::vector<Part> parts_;
  std::size_t done_ = 0;
  int failures_ = 0;
  std::int32_t reason_ = 0;
  std::string cause_;
};

}  // namespace axlecast::tsubaki_sc
