#include "drivers/tsubaki_sc/readout.h"

#include <algorithm>
#include <cassert>

namespace axlecast::tsubaki_sc {

BlockReader::BlockReader(const Requests& requests, const std::vector<Block>& blocks) : requests_(&requests) {
  for (const Block& block : blocks) parts_.push_back({block, {}});
}

Result<bool> BlockReader::OnAnswer(const Answer& answer) {
  if (!answer.ok()) {
    if (MayRepeat(answer, failures_)) return false;
    return Failure(ErrorOf(answer));
  }
  failures_ = 0;
  parts_[done_].data = InlineBytes<kMaxBytes>(answer.reply.data);
  return ++done_ == parts_.size();
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
