#pragma once

#include <array>
#include <cstdint>
#include <optional>
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

// Reads some blocks and shows them.
class Readout final : public Procedure {
 public:
  using Show = Outcome (*)(const BlockReader& read, CharacterOrder order, const std::string& after);

  // `after` is handed on to `show`.
  Readout(const Requests& requests, std::vector<Block> blocks, Show show, CharacterOrder order, std::string after)
      : reader_(requests, std::move(blocks)), show_(show), order_(order), after_(std::move(after)) {}

  [[nodiscard]] Exchange Next() const override { return reader_.Next(); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;

 private:
  BlockReader reader_;
  Show show_;
  CharacterOrder order_;
  std::string after_;
};

// read_state: status, stop coil, login and mains. `after` an operation: the change `finding` shows whether it took
// effect.
[[nodiscard]] std::vector<Block> StateBlocks();
[[nodiscard]] Outcome ShowState(const BlockReader& read, CharacterOrder order, const std::string& after);

// read_set_values: the values that hold at the present DIP switch setting and mains frequency (AI 0-8).
[[nodiscard]] Outcome ShowSetValues(const BlockReader& read, CharacterOrder order, const std::string& after);

// read_identity: product code, MFG number and version.
[[nodiscard]] std::vector<Block> IdentityBlocks();
[[nodiscard]] Outcome ShowIdentity(const BlockReader& read, CharacterOrder order, const std::string& after);

}  // namespace axlecast::tsubaki_sc
