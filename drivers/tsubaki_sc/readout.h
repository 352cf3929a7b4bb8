#pragma once

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// Reads a few blocks one after the other and keeps their data. Not for passwords.
class BlockReader {
 public:
  BlockReader(const Requests& requests, const std::vector<Block>& blocks) : requests_(&requests) {
    for (const Block& block : blocks) parts_.push_back({block, {}});
  }

  [[nodiscard]] Exchange Next() const { return requests_->Read(parts_[done_].block); }
  // Returns true if all blocks are read, false to continue, or an error with a REASON_*.
  [[nodiscard]] Result<bool> OnAnswer(const Answer& answer) {
    if (!answer.ok()) {
      if (MayRepeat(answer, failures_)) return false;
      return Failure(ErrorOf(answer));
    }
    failures_ = 0;
    parts_[done_].data = InlineBytes<kMaxBytes>(answer.reply.data);
    return ++done_ == parts_.size();
  }
  void Restart() {
    done_ = 0;
    failures_ = 0;
  }

  // The functions below are for a block that was read.
  [[nodiscard]] Bytes Data(const Block& block) const {
    const auto found =
        std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) { return part.block == block; });
    assert(found != parts_.end());
    return found->data;
  }
  [[nodiscard]] std::uint16_t Register(const Block& block, std::size_t index) const {
    const Bytes data = Data(block);
    return static_cast<std::uint16_t>((data[2 * index] << 8) | data[2 * index + 1]);
  }
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
};

// Reads some blocks and shows them.
class Readout final : public Procedure {
 public:
  using Show = std::function<Outcome(const BlockReader& read)>;

  Readout(const Requests& requests, const std::vector<Block>& blocks, Show show)
      : reader_(requests, blocks), show_(std::move(show)) {}

  [[nodiscard]] Exchange Next() const override { return reader_.Next(); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    const Result<bool> done = reader_.OnAnswer(answer);
    if (!done) return GiveUp(done.error());
    return *done ? std::optional(show_(reader_)) : std::nullopt;
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    return Final(CommandState::kFailed, error.reason, "it could not be read: " + error.text);
  }

 private:
  BlockReader reader_;
  Show show_;
};

}  // namespace axlecast::tsubaki_sc
