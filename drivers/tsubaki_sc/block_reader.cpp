#include "drivers/tsubaki_sc/block_reader.h"

#include <algorithm>
#include <cassert>

namespace axlecast::tsubaki_sc {

BlockReader::BlockReader(const Requests& requests, std::vector<Block> blocks) : requests_(&requests) {
  for (const Block& block : blocks) parts_.push_back({block, {}});
}

BlockReader::Progress BlockReader::OnAnswer(const Answer& answer) {
  if (!answer.ok()) {
    cause_ = CauseOf(answer);
    reason_ = ReasonOf(answer);
    return !answer.refused() && ++failures_ < kTries ? Progress::kGoing : Progress::kFailed;
  }
  failures_ = 0;
  parts_[done_].data = InlineBytes<kMaxBytes>(answer.reply.data);
  return ++done_ < parts_.size() ? Progress::kGoing : Progress::kDone;
}

void BlockReader::Restart() {
  done_ = 0;
  failures_ = 0;
}

Bytes BlockReader::Data(const Block& block) const {
  const auto found =
      std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) { return part.block == block; });
  assert(found != parts_.end());
  return found->data;
}

std::uint16_t BlockReader::Register(const Block& block, std::size_t index) const {
  const Bytes data = Data(block);
  return static_cast<std::uint16_t>((data[2 * index] << 8) | data[2 * index + 1]);
}

}  // namespace axlecast::tsubaki_sc
