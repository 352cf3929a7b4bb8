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
  const auto [entry, first] = publishers_.try_emplace(boot_id, Publisher{seq});
  if (first) {
    if (publishers_.size() > kPublishers)
      publishers_.erase(entry == publishers_.begin() ? std::next(entry) : publishers_.begin());
    return;
  }
  Publisher& publisher = entry->second;
  if (seq <= publisher.newest) return FillGap(publisher, seq);
  if (seq > publisher.newest + 1) {
    lost_ += seq - publisher.newest - 1;
    publisher.gaps[publisher.newest + 1] = seq - 1;
    if (publisher.gaps.size() > kGaps) publisher.gaps.erase(publisher.gaps.begin());
  }
  publisher.newest = seq;
}

void SequenceCount::FillGap(Publisher& publisher, std::int64_t seq) {
  auto gap = publisher.gaps.upper_bound(seq);
  if (gap == publisher.gaps.begin()) return;
  --gap;
  const auto [begin, end] = *gap;
  if (seq > end) return;  // it was received
  --lost_;
  publisher.gaps.erase(gap);
  if (begin < seq) publisher.gaps[begin] = seq - 1;
  if (seq < end) publisher.gaps[seq + 1] = end;
}

}  // namespace axlecast
