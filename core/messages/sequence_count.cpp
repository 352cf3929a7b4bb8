#include "core/messages/sequence_count.h"

#include <iterator>

namespace axlecast {
namespace {

constexpr std::size_t kPublishers = 64;  // remembered: anybody may invent boot ids
constexpr std::int64_t kLargestSeq = INT64_C(1)
                                     << 53;  // centuries at any rate; beyond it the number is no number of ours

}  // namespace

void SequenceCount::On(std::int64_t boot_id, std::int64_t seq) {
  ++received_;
  if (seq < 0 || seq > kLargestSeq) return;
  const auto [entry, first] = newest_.try_emplace(boot_id, seq);
  if (first) {
    if (newest_.size() > kPublishers) newest_.erase(entry == newest_.begin() ? std::next(entry) : newest_.begin());
    return;
  }
  if (seq > entry->second) {
    lost_ += seq - entry->second - 1;
    entry->second = seq;
  } else if (seq < entry->second && lost_ > 0) {
    --lost_;  // late, after a newer one
  }
}

}  // namespace axlecast
