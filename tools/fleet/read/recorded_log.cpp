#include "tools/fleet/read/recorded_log.h"

namespace axlecast {

void RecordedLogEncoder::AddHeader(std::int64_t utime, std::string_view channel, std::string_view text) {
  Write({.number = next_, .utime = utime, .channel = channel, .data = AsBytes(text)});
}

void RecordedLogEncoder::Add(const LogEvent& event) {
  if (event.number == next_ + 1) {
    const std::vector<std::uint8_t> seal = EncodeSeal(open_.seal());
    Write({.number = next_, .utime = utime_, .channel = kSealChannel, .data = seal});
  }
  Write(event);
}

bool RecordedLogEncoder::End() {
  if (open_.seal().events > 0) {
    const std::vector<std::uint8_t> seal = EncodeSeal(open_.seal());
    Write({.number = next_, .utime = utime_, .channel = kSealChannel, .data = seal});
  }
  return good_;
}

void RecordedLogEncoder::Write(const LogEvent& event) {
  record_.clear();
  AppendEvent(record_, event);
  if (event.channel == kSealChannel) {
    open_.Reset();
  } else {
    open_.Add(record_);
  }
  next_ = event.number + 1;
  utime_ = event.utime;
  if (good_) good_ = out_(record_);
}

void RawCoverage::Add(std::int64_t first_event, std::int64_t n) {
  const std::int64_t expected = records_ == 0 ? kHeaderEvents : next_;
  if (first_event != expected && first_event != expected + 1) whole_ = false;
  next_ = first_event + n;
  records_ += n;
}

bool RawCoverage::IsWhole(std::int64_t upto) const {
  return whole_ && records_ > 0 && (upto == next_ || upto == next_ + 1);
}

}  // namespace axlecast
