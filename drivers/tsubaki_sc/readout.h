#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/tsubaki_sc/block_reader.h"

namespace axlecast::tsubaki_sc {

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

// read_state: status, stop coil, login and mains. `after` an operation: the change `finding` says whether it took
// effect.
[[nodiscard]] std::vector<Block> StateBlocks();
[[nodiscard]] Outcome ShowState(const BlockReader& read, CharacterOrder order, const std::string& after);

// read_set_values: the values that hold at the present DIP switch setting and mains frequency (AI 0-8).
[[nodiscard]] Outcome ShowSetValues(const BlockReader& read, CharacterOrder order, const std::string& after);

// read_identity: product code, MFG number and version.
[[nodiscard]] std::vector<Block> IdentityBlocks();
[[nodiscard]] Outcome ShowIdentity(const BlockReader& read, CharacterOrder order, const std::string& after);

}  // namespace axlecast::tsubaki_sc
