#include "tools/axlecast/command/offset_capture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/text.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

double Rpm(const position_t& reading) { return reading.speed_rad_s * 60 / (2 * std::numbers::pi); }

bool Has(const position_t& reading, std::int32_t flag) { return (reading.flags & flag) != 0; }

}  // namespace

void OffsetCapture::On(const device_info_t& info) {
  if (first_ && info.boot_id != first_->boot_id) return;  // of another start of the driver
  info_ = info;
}

void OffsetCapture::On(const position_t& reading) {
  if (done() || !Has(reading, position_t::FLAG_VALID) || reading.counts_per_turn <= 0) return;
  if (!first_) {
    first_ = reading;
    lowest_ = highest_ = reading.counts;
    if (info_ && info_->boot_id != reading.boot_id) info_.reset();
  }
  Check(reading);
  if (!problem_.empty()) return;
  ++count_;
  sum_ += static_cast<double>(reading.counts - first_->counts);
  lowest_ = std::min(lowest_, reading.counts);
  highest_ = std::max(highest_, reading.counts);
}

void OffsetCapture::Check(const position_t& reading) {
  const double turns = std::abs(static_cast<double>(reading.counts) - static_cast<double>(first_->counts)) /
                       static_cast<double>(reading.counts_per_turn);
  if (Has(reading, position_t::FLAG_SPEED_VALID) && std::abs(Rpm(reading)) > kMaxSpeedRpm) {
    problem_ = "it turns, at " + Decimal(Rpm(reading), 2) + " rpm: stop it, then capture again";
  } else if (reading.boot_id != first_->boot_id) {
    problem_ = "its driver was restarted meanwhile: capture again";
  } else if (reading.datum_epoch != first_->datum_epoch) {
    problem_ = "its datum changed meanwhile: capture again";
  } else if (turns > kMaxSpreadTurns) {
    problem_ = "it moved by " + Decimal(turns * 360, 3) + " degrees meanwhile: stop it, then capture again";
  }
}

double OffsetCapture::counts() const {
  return static_cast<double>(first_->counts) + static_cast<double>(info_->datum_counts) +
         sum_ / static_cast<double>(count_);
}

std::int64_t OffsetCapture::Datum(double value) const {
  const double unit_per_count =
      info_->per_turn * static_cast<double>(info_->ratio_num) /
      (static_cast<double>(info_->ratio_den) * static_cast<double>(info_->counts_per_turn));
  return std::llround(counts() - value / unit_per_count);
}

std::string OffsetCapture::Text(const std::string& device, double value) const {
  return device + ": " + std::to_string(count_) + " readings at rest, mean " + Decimal(counts(), 1) +
         " counts, spread " + std::to_string(spread()) + " counts\nin the machine's file, below " + device +
         ", so that it reads " + Decimal(value, 6) + ' ' + std::string(UnitName(info_->unit)) +
         " here:\ndatum: {counts: " + std::to_string(Datum(value)) + "}\n";
}

nlohmann::ordered_json OffsetCapture::Json(const std::string& device, double value) const {
  return {{"device", device},   {"samples", count_}, {"counts", counts()},
          {"spread", spread()}, {"value", value},    {"datum", Datum(value)}};
}

}  // namespace axlecast
