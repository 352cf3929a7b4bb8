#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The datum of an axis: the counts (after direction) that read 0, since when, and whether it may be trusted.
class Reference {
 public:
  explicit Reference(const DeviceConfig& device);

  struct Datum {
    std::int64_t counts = 0;
    std::int64_t utime = 0;  // 0: from the file, or unknown

    friend bool operator==(const Datum&, const Datum&) = default;
  };

  // A datum, established at the instant `set_at`. One that was established before the reference was lost does not
  // bring it back. The same datum again changes nothing.
  void Set(const Datum& datum, MonoNs set_at, MonoNs now);
  // Whether an instant that was given lies between `since` and `now`, allowing 2 s for a `now` that lags: a stamp
  // from the future comes from a wrong clock.
  [[nodiscard]] static bool Within(MonoNs instant, MonoNs since, MonoNs now);

  void Lose(MonoNs now);
  void Restore() { lost_ = false; }
  // Counts changed without motion.
  void Jump() { ++epoch_; }
  // The datum that was set goes: the file's, or none, is in force.
  void Clear();
  // The encoder's own zero was moved: a datum counted from the old one means nothing any more.
  void DropDatum();

  [[nodiscard]] std::int64_t datum() const { return datum_ ? datum_->counts : 0; }  // 0 without one
  [[nodiscard]] std::int64_t utime() const { return datum_ ? datum_->utime : 0; }
  [[nodiscard]] bool has_datum() const { return datum_.has_value(); }
  [[nodiscard]] const std::optional<Datum>& of_file() const { return of_file_; }
  [[nodiscard]] bool lost() const { return lost_; }
  [[nodiscard]] std::int32_t epoch() const { return epoch_; }

 private:
  std::optional<Datum> of_file_;
  std::optional<Datum> datum_;
  std::int32_t epoch_ = 0;
  bool lost_ = false;
  MonoNs lost_at_ = 0;
};

}  // namespace axlecast
