#include "drivers/runtime/axis/reference.h"

#include <algorithm>

namespace axlecast {
namespace {

// Further than any axis goes, and far enough from overflow.
constexpr std::int64_t kMaxCounts = INT64_C(1) << 60;

}  // namespace

Reference::Reference(const DeviceConfig& device) {
  if (device.datum_counts) of_file_ = Datum{std::clamp(*device.datum_counts, -kMaxCounts, kMaxCounts), 0};
  datum_ = of_file_;
}

bool Reference::Within(MonoNs instant, MonoNs since, MonoNs now) {
  constexpr MonoNs kLag = 2 * kSecond;
  return instant >= since && instant <= now + kLag;
}

void Reference::Set(const Datum& datum, MonoNs set_at, MonoNs now) {
  const Datum given{std::clamp(datum.counts, -kMaxCounts, kMaxCounts), datum.utime};
  if (lost_ && Within(set_at, lost_at_, now)) lost_ = false;
  if (datum_ == given) return;
  datum_ = given;
  Jump();
}

void Reference::Lose(MonoNs now) {
  if (!lost_) lost_at_ = now;
  lost_ = true;
}

void Reference::Clear() {
  if (!datum_ || datum_ == of_file_) return;
  DropDatum();
  Jump();
}

void Reference::DropDatum() { datum_ = of_file_; }

}  // namespace axlecast
